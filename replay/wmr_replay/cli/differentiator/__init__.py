"""What ``wmr-replay diff`` computes, tabulates and plots."""
