"""Brakes and what they consist of: band, linings, pulley, bandage; discs with pads, drums with shoes."""
