"""Read files that anybody may have written: bytes in, plain values out, or a refusal in words. See README.md here."""
