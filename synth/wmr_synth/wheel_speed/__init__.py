"""Robots that wheel speeds drive: chassis, ground, drive, contact, encoders, and the logs that they
record.
"""
