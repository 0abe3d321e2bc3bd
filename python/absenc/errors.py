# SPDX-License-Identifier: Apache-2.0
"""What absenc raises. Everything is an AbsencError; what an encoder did wrong has a class for each kind."""
from __future__ import annotations

from typing import Optional


class AbsencError(Exception):
    """Anything that this package raises by itself."""

    #: Of a call that changes the encoder: "not_sent", "confirmed" (but reading it again failed), "refused", or "unknown":
    #: it was sent, and nothing good came back. None: the call changes nothing.
    change: Optional[str] = None


class UsageError(AbsencError, ValueError):
    """What was asked for cannot be: a sentence that names what is wrong and, of names, the nearest."""


class Failure(AbsencError):
    """A file, or an encoder that answered well, is not what was expected."""


class Cancelled(AbsencError):
    """The encoder was closed while something waited for it."""


class PortError(AbsencError, OSError):
    """Trouble with a port. `kind` is "not_found", "no_permission", "in_use", "unsupported", "bad_rate", "lost" or
    "system"."""

    def __init__(self, sentence: str, kind: str) -> None:
        super().__init__(sentence)
        self.kind = kind


class EncoderError(AbsencError):
    """An encoder did not do what it was asked, or a frame is not good. The texts may be empty."""

    name = ""  #: as the command and captures have it

    def __init__(self, text: str, message: str, exchange: str, advice: str, sent: str, received: str) -> None:
        super().__init__(text)
        self.message = message  #: what happened
        self.exchange = exchange  #: what was sent, what came back and when, in words
        self.advice = advice  #: what to try
        self.sent = sent  #: "1A"
        self.received = received  #: "1A 00 45"

    def __reduce__(self) -> tuple[object, ...]:
        texts = (str(self), self.message, self.exchange, self.advice, self.sent, self.received)
        return type(self), texts, {"change": self.change}


class InvalidArgument(EncoderError):
    """This cannot be done as it was asked."""

    name = "invalid_argument"


class Unsupported(EncoderError):
    """This encoder or model does not have that."""

    name = "unsupported"


class BufferTooSmall(EncoderError):
    """More came than fits."""

    name = "buffer_too_small"


class Timeout(EncoderError):
    """The encoder did not answer."""

    name = "timeout"


class LineStuck(EncoderError):
    """The data line never changed its level."""

    name = "line_stuck"


class BadFraming(EncoderError):
    """What came is not a frame of this protocol."""

    name = "bad_framing"


class Truncated(EncoderError):
    """The frame does not fit into what was sampled."""

    name = "truncated"


class WrongLength(EncoderError):
    """The frame has the wrong length."""

    name = "wrong_length"


class UnexpectedReply(EncoderError):
    """The reply does not belong to the request."""

    name = "unexpected_reply"


class BadChecksum(EncoderError):
    """The checksum is wrong."""

    name = "bad_checksum"


class OutOfRange(EncoderError):
    """Bits that must be zero are set."""

    name = "out_of_range"


class SequenceMismatch(EncoderError):
    """The sequence counter did not move as it should."""

    name = "sequence_mismatch"


class CrossCheckFailed(EncoderError):
    """Parts of the reply contradict each other."""

    name = "cross_check_failed"


class Busy(EncoderError):
    """The encoder stayed busy."""

    name = "busy"


class RequestRejected(EncoderError):
    """The encoder refused the request."""

    name = "request_rejected"


class NotStill(EncoderError):
    """The shaft is turning, and this needs it standing still."""

    name = "not_still"


#: The classes by the names of the errors.
by_name: dict[str, type[EncoderError]] = {one.name: one for one in EncoderError.__subclasses__()}
