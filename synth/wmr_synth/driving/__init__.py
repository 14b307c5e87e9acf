"""Who drives, and what happens on the way: drivers, patrol, plan."""
