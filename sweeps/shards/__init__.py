"""Files of measured points (shards), merged into a map: chunks, hashes, checksums."""
