"""Measured comparisons of simbrake with other tools; each module is a program of its
own."""
