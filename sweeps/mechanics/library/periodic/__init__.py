"""Descriptions of systems periodic in time that ship."""
