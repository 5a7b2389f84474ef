"""What people look at: pictures, the report, a map in text."""
