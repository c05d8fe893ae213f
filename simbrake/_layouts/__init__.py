"""The design of lining layouts."""
