# SPDX-License-Identifier: Apache-2.0
"""Exceptions of absenc; EncoderError has a subclass for each kind of error."""
from __future__ import annotations

from typing import Optional


class AbsencError(Exception):
    """Base class of the exceptions of this package."""

    #: For a call that changes the encoder, the state of the change: "not_sent", "confirmed", "refused" or "unknown";
    #: otherwise None.
    change: Optional[str] = None


class UsageError(AbsencError, ValueError):
    """An argument is invalid."""


class Failure(AbsencError):
    """A file, or an encoder whose replies are valid, is not as expected."""


class Cancelled(AbsencError):
    """The encoder was closed while this call waited."""


class PortError(AbsencError, OSError):
    """A port cannot be opened or used. `kind` is "not_found", "no_permission", "in_use", "unsupported", "bad_rate",
    "lost" or "system"."""

    def __init__(self, sentence: str, kind: str) -> None:
        super().__init__(sentence)
        self.kind = kind


class EncoderError(AbsencError):
    """A request to an encoder failed, or a frame is invalid. The texts may be empty."""

    name = ""  #: name in the command's output and in captures

    def __init__(self, text: str, message: str, exchange: str, advice: str, sent: str, received: str) -> None:
        super().__init__(text)
        self.message = message  #: what happened
        self.exchange = exchange  #: sent and received bytes with their times, in words
        self.advice = advice  #: what to try
        self.sent = sent  #: sent frame: "1A"
        self.received = received  #: received bytes: "1A 00 45"

    def __reduce__(self) -> tuple[object, ...]:
        texts = (str(self), self.message, self.exchange, self.advice, self.sent, self.received)
        return type(self), texts, {"change": self.change}


class InvalidArgument(EncoderError):
    """An argument of the command is invalid."""

    name = "invalid_argument"


class Unsupported(EncoderError):
    """This encoder or model does not support the command."""

    name = "unsupported"


class BufferTooSmall(EncoderError):
    """The reply is larger than the buffer."""

    name = "buffer_too_small"


class Timeout(EncoderError):
    """The encoder did not reply."""

    name = "timeout"


class LineStuck(EncoderError):
    """The data line never changed its level."""

    name = "line_stuck"


class BadFraming(EncoderError):
    """The received bytes are no frame of this protocol."""

    name = "bad_framing"


class Truncated(EncoderError):
    """The frame is longer than the sampled bits."""

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
    """The sequence counter did not advance as specified."""

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
    """The command needs a stationary shaft, but the shaft is turning."""

    name = "not_still"


#: Subclasses of EncoderError, by the name of the error.
by_name: dict[str, type[EncoderError]] = {one.name: one for one in EncoderError.__subclasses__()}
