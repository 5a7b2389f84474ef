"""CCSDS Attitude Ephemeris Messages (AEM) in keyword-value notation: quaternions, with or without angular velocity.

A message of one segment::

    CCSDS_AEM_VERS = 1.0
    META_START
    REF_FRAME_A = EME2000
    REF_FRAME_B = SC_BODY_1
    ATTITUDE_DIR = A2B
    ATTITUDE_TYPE = QUATERNION
    QUATERNION_TYPE = LAST
    META_STOP
    DATA_START
    2002-12-18T12:00:00.331 0.56748 0.03146 0.45689 0.68427
    DATA_STOP

The quaternion (Q1, Q2, Q3, QC) = (e sin φ/2, cos φ/2) turns the axes of frame A by the angle φ about e into those of
frame B. For an inertial A and a body-fixed B it is our attitude: Hamilton's unit quaternion that takes vectors from the
body's axes to axes of space. In the opposite direction it is the conjugate.

Source: CCSDS 504.0-B-1 (2008), sections 4 and annex A; 504.0-B-2 (2024), section 4, in which the scalar is last, A to B
the only direction, and QUATERNION/ANGVEL a type. `message_lines` writes this one.
"""

import io
import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import islice

import numpy as np

from sweeps.reading import tables
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import cut_text, display

HEADER_BYTES = 2**16  # bytes within which the data begin
TYPES = {  # ATTITUDE_TYPE → numbers of a row after the quaternion
    "QUATERNION": (), "QUATERNION/DERIVATIVE": ("dq1", "dq2", "dq3", "dqc"),
    "QUATERNION/ANGVEL": ("w1", "w2", "w3"), "QUATERNION/RATE": ("w1", "w2", "w3"),
}  # fmt: skip
SCALAR_LAST, SCALAR_FIRST = ("q1", "q2", "q3", "qc"), ("qc", "q1", "q2", "q3")
DATA_START = re.compile(r"^[ \t]*DATA_START[ \t]*\r?\n", re.MULTILINE)
KEYWORD = re.compile(r"\s*([A-Z0-9_]+)\s*=\s*(.*?)\s*")
EPOCH = re.compile(r"(\d{4})-(?:(\d\d)-(\d\d)|(\d{3}))T(\d\d):(\d\d):(\d\d)(\.\d+)?Z?")
DAY = 86_400
TIME_0 = np.datetime64("2000-01-01T00:00:00", "s")  # epoch of the time 0 in messages of ours
LAST_SECOND = int((np.datetime64("9999-12-31T23:59:59", "s") - TIME_0).astype(int))  # years have four digits


class AttitudeMessage(tables.Source):
    """The data of an AEM: time from the first epoch (s), quaternion, angular velocity (deg/s) in the body's axes."""

    def __init__(self, file: FileBytes, other_types: bool = False):
        super().__init__(file, other_types)
        head = file.read_at(0, min(file.size, HEADER_BYTES)).decode("latin-1")
        mark = DATA_START.search(head)
        if not mark or not head.lstrip("\xef\xbb\xbf\r\n ").startswith("CCSDS_AEM_VERS"):
            raise self._refuse("is no attitude ephemeris message", "CCSDS AEM in keyword-value notation (KVN)")
        self.metadata = {m[1]: m[2] for line in head[: mark.start()].splitlines() if (m := KEYWORD.fullmatch(line))}
        self._begin = mark.end()
        kind = self._keyword("ATTITUDE_TYPE", tuple(TYPES))
        order = self._keyword("QUATERNION_TYPE", ("LAST", "FIRST"))
        names = [*(SCALAR_LAST if order == "LAST" else SCALAR_FIRST), *TYPES[kind]]
        self.headings = [("time", "s"), *((name, "deg/s" if name[0] == "w" else "") for name in names)]
        body = "A" if "BODY" in self.metadata.get("REF_FRAME_A", "") else "B"
        to_b = self._keyword("ATTITUDE_DIR", ("A2B", "B2A")) == "A2B"
        self.space_to_body = (body == "B") != to_b  #: True if the quaternions are the conjugates of our attitude
        frame = self.metadata.get("ANGVEL_FRAME", self.metadata.get("RATE_FRAME", f"REF_FRAME_{body}"))
        if frame not in (f"REF_FRAME_{body}", self.metadata.get(f"REF_FRAME_{body}")):
            raise self._refuse(f"has angular velocity in the frame {cut_text(frame)}", "that of the body")

    def _refuse(self, reason: str, allowed: str, value: str = ""):
        return tables.refusal("", value or display(self.name), reason, allowed)

    def _keyword(self, name: str, allowed: Sequence[str]) -> str:
        """Return the value of a keyword of the metadata, the first that is allowed if the message leaves it out."""
        value = self.metadata.get(name, allowed[0])
        if value not in allowed:
            raise self._refuse(f"has {name} = {cut_text(value)}", ", ".join(allowed))
        return value

    def sample_rows(self) -> list[list[str]]:
        """Return the values of the first and the last rows as written."""
        return [line.split() for line in tables.sample_lines(self._file, self._begin)]

    def read_rows(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows, in the child."""
        lines, begin, number = self._data_lines(), None, 0
        while rows := [line.split() for line in islice(lines, tables.PART_ROWS)]:
            wrong = next((k for k, row in enumerate(rows) if len(row) != len(self.headings)), None)
            if wrong is not None:
                value = f"row {number + wrong + 1:,} ({len(rows[wrong])} values)"
                raise self._refuse("is no row of the message", f"{len(self.headings)} values in every row", value)
            try:
                whole, fraction = _epochs([row[0] for row in rows])
                values = np.array([row[1:] for row in rows], dtype="f8")
            except ValueError as error:
                where = f"rows from {number + 1:,}"
                raise self._refuse(f"hold what is no number ({cut_text(str(error))})", "numbers", where) from None
            begin = begin or (whole[0], fraction[0])
            times = (whole - begin[0]) + (fraction - begin[1])
            yield np.column_stack([times, values])[:, places]
            number += len(rows)

    def _data_lines(self) -> Iterator[str]:
        """Yield the lines of the data, without comments and empty lines, in the child."""
        self._file.seek(self._begin)
        buffered = io.BufferedReader(self._file)
        while line := buffered.readline(tables.LONGEST_LINE):
            text = line.decode("ascii", "replace").strip()
            if text == "DATA_STOP":
                break
            if text and not text.startswith("COMMENT"):
                yield text
        if "META_START" in buffered.read(HEADER_BYTES).decode("ascii", "replace"):
            raise self._refuse("has several segments", "a message of one segment")


def _epochs(texts: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return whole seconds and fractions of a second of epochs, 2002-12-18T12:00:00.331 or 2002-352T12:00:00.331."""
    matches = [match for text in texts if (match := EPOCH.fullmatch(text))]
    if len(matches) < len(texts):
        raise ValueError(f"epoch {next(text for text in texts if not EPOCH.fullmatch(text))!r}")
    dates = [f"{m[1]}-{m[2] or '01'}-{m[3] or '01'}" for m in matches]
    days = np.array(dates, dtype="M8[D]").astype(np.int64) + np.array([int(m[4] or 1) - 1 for m in matches])
    seconds = [3600 * int(m[5]) + 60 * int(m[6]) + int(m[7]) for m in matches]
    return days * DAY + np.array(seconds), np.array([float(m[8] or 0) for m in matches])


def message_lines(
    name: str, times: np.ndarray, q: np.ndarray, rates: np.ndarray, comments: Sequence[str] = ()
) -> Iterator[str]:
    """Yield the lines of a message of the type QUATERNION/ANGVEL, 504.0-B-2, which is read again bit for bit.

    Args:
        name: of the body.
        times: s, from 2000-01-01T00:00:00 TAI, shape (n,).
        q: unit quaternions, scalar first, from the body's axes to axes of space, (n, 4).
        rates: angular velocity in the body's axes, deg/s, (n, 3).
        comments: lines for people.
    """
    whole = np.floor(times).astype(np.int64)
    dates = np.datetime_as_string(TIME_0 + whole.astype("m8[s]"))
    fractions = (np.format_float_positional(each, trim="0")[1:] for each in times - whole)  # 0.25 as .25
    epochs = [date + fraction for date, fraction in zip(dates, fractions, strict=True)]
    name, now = " ".join(name.split()), datetime.now(UTC)
    yield from ("CCSDS_AEM_VERS = 2.0", f"CREATION_DATE = {now:%Y-%m-%dT%H:%M:%S}", "ORIGINATOR = POLHODE")
    yield from ("META_START", *(f"COMMENT {line}" for line in comments), f"OBJECT_NAME = {name}", f"OBJECT_ID = {name}")
    yield from ("REF_FRAME_A = EME2000", "REF_FRAME_B = SC_BODY_1", "TIME_SYSTEM = TAI")
    yield from (f"START_TIME = {epochs[0]}", f"STOP_TIME = {epochs[-1]}")
    yield from ("ATTITUDE_TYPE = QUATERNION/ANGVEL", "ANGVEL_FRAME = REF_FRAME_B", "META_STOP", "DATA_START")
    for epoch, row in zip(epochs, np.column_stack([q[:, 1:], q[:, :1], rates]), strict=True):
        yield " ".join([epoch, *(f"{value:.17g}" for value in row)])
    yield "DATA_STOP"
