"""Plotly's script for the page: its bundle of plane charts alone, deflated, with its licence.

The file is `plotly-cartesian.min.js` of the package `plotly.js-cartesian-dist-min`, version and hash below, as it is
there, through `zlib.compress(…, 9)`. The whole of Plotly is three times as long, and pages draw no further charts.
"""

import base64
import hashlib
import zlib
from functools import cache
from importlib.resources import files

VERSION = "4.1.1"
SHA256 = "79542150855a52c567260e3137095dbe2b744e6d702a5cabe67da246942fba7a"  # hash of the inflated script


@cache
def deflated() -> str:
    """Return the script, deflated, as base64."""
    return base64.b64encode(_file()).decode("ascii")


@cache
def digest() -> str:
    """Return the SHA-256 of the script as base64."""
    sha256 = hashlib.sha256(zlib.decompress(_file()))
    if sha256.hexdigest() != SHA256:
        raise ValueError(f"plotly-cartesian.min.js: SHA-256 is {sha256.hexdigest()}; allowed: {SHA256}")
    return base64.b64encode(sha256.digest()).decode("ascii")


def _file() -> bytes:
    return (files(__name__) / "plotly-cartesian.min.js.zlib").read_bytes()
