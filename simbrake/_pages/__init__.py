"""The report as one page, and what a run leaves in a folder."""
