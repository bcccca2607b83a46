# SPDX-License-Identifier: BSD-3-Clause
"""A Bokeh server for one view.

It listens at the loopback address; at another one every view needs the token of the address that is printed.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Callable
from typing import Any

from bokeh.models import Div
from bokeh.server.server import Server

LOOPBACK = ("127.0.0.1", "::1", "localhost")


def serve(view: Callable[[Any], None], address: str, port: int, token: str | None = None) -> tuple[Server, str]:
    """(the server, started; the address of its page); ``view`` fills a document for each browser."""

    def guarded(doc: Any) -> None:  # a Document of bokeh, whose request its types do not know
        doc.title = "Fluxproof"
        if allowed(token, doc.session_context.request.arguments):
            view(doc)
        else:
            doc.add_root(Div(text="The address needs the token that was printed with it."))

    origins = None if address in LOOPBACK else [f"{address}:{port}"]
    server = Server({"/": guarded}, port=port, address=address, allow_websocket_origin=origins)
    server.start()
    host = f"[{address}]" if ":" in address else address
    return server, f"http://{host}:{server.port}/" + (f"?token={token}" if token else "")


def token_for(address: str) -> str | None:
    """None for the loopback address; else a new token."""
    return None if address in LOOPBACK else secrets.token_urlsafe(18)


def allowed(token: str | None, arguments: dict[str, list[bytes]]) -> bool:
    """Whether a request has the token."""
    given = (arguments.get("token") or [b""])[0]
    return token is None or hmac.compare_digest(given, token.encode())
