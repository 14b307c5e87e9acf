"""Two logs of one robot: what ``gap`` finds on the first is given to ``run`` on the second."""
