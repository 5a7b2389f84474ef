"""Points measured into files, and files merged into a map: chunks, hashes and checksums."""
