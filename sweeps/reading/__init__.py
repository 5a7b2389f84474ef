"""Files from outside: bytes in, plain values out, or a refusal. Its README.md is the threat model."""
