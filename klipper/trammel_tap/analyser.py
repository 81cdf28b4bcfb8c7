# Analyses of taps beside Klipper's reactor
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Keeps Klipper's reactor free while a tap is analysed."""
import logging
import threading
from typing import Any, Optional

from .library import Answer, Context, Tap, TapError

LIMIT_S = 2.  # 2000 times what a tap takes


class Analyser:
    """Analyses taps on a thread of its own, so that no timer of Klipper's ever waits for one."""

    def __init__(self, reactor: Any, library: Any, limit: float = LIMIT_S) -> None:
        self._reactor = reactor
        self._library = library
        self._limit = limit
        self._thread = None  # type: Optional[threading.Thread]

    def hangs(self) -> bool:
        """Returns whether an analysis that was given up has still not ended."""
        return self._thread is not None and self._thread.is_alive()

    def analyse(self, tap: Tap, context: Context) -> Answer:
        """Pauses the calling greenlet until the answer is there; TapError after the limit."""
        if self.hangs():
            raise TapError("an earlier analysis has not ended; restart Klipper's service")
        completion = self._reactor.completion()
        self._thread = threading.Thread(target=self._run, args=(completion, tap, context))
        self._thread.daemon = True
        self._thread.start()
        result = completion.wait(self._reactor.monotonic() + self._limit)
        if isinstance(result, Answer):
            return result
        raise TapError(result or "the analysis took longer than %.0f s" % self._limit)

    def _run(self, completion: Any, tap: Tap, context: Context) -> None:
        try:
            result = self._library.analyse(tap, context)  # type: Any
        except Exception as e:
            logging.exception("trammel_tap: analysis")
            result = str(e) or repr(e)
        self._reactor.async_complete(completion, result)
