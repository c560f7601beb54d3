"""A real, certified provider of OpenID Connect on this machine, and somebody who signs in there without a browser."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Final
from urllib.parse import parse_qsl, urljoin, urlsplit

import httpx
import pytest
from running_consoles import end, plain_client

FOLDER: Final = Path(__file__).parent / "identity_provider"
CLIENT: Final = "league of the school"
SECRET: Final = "s3cret ~+/x"
"""With signs that are written in another way in a header."""

needs_identity_provider = pytest.mark.skipif(
    shutil.which("node") is None or not (FOLDER / "node_modules" / "oidc-provider").exists(),
    reason="the provider is not installed: make test does it",
)


@contextmanager
def identity_provider() -> Iterator[str]:
    """Its address, while it runs."""
    command = ["node", str(FOLDER / "provider.mjs"), CLIENT, SECRET]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout is not None
        issuer = process.stdout.readline().strip()
        assert issuer
        yield issuer
    finally:
        end(process)


def sign_in_there(to: str, name: str, *, browser: httpx.Client | None = None) -> dict[str, str]:
    """From the address that a league sends somebody to, through the provider's forms, to what a browser brings back.

    The provider's cookies stay in a browser, if one is given.
    """
    with nullcontext(browser) if browser is not None else plain_client() as client:
        reply = client.get(to)
        for _ in range(20):
            if reply.is_redirect:
                place = urlsplit(urljoin(str(reply.url), reply.headers["location"]))
                if place.path == "/oidc":
                    return dict(parse_qsl(place.query))
                reply = client.get(place.geturl())
                continue
            form = re.search(r'action="([^"]+)"', reply.text)
            assert form is not None, reply.text
            fields = dict(re.findall(r'name="(\w+)" value="([^"]*)"', reply.text))
            if 'name="login"' in reply.text:
                fields |= {"login": name, "password": "x"}
            reply = client.post(urljoin(str(reply.url), form[1]), data=fields)
    raise AssertionError("it leads nowhere")


def sign_out_there(issuer: str, browser: httpx.Client) -> None:
    """Of the provider, in a browser that is signed in there, and by its form."""
    page = browser.get(f"{issuer}/session/end")
    form = re.search(r'action="([^"]+)".*?name="xsrf" value="([^"]+)"', page.text, re.DOTALL)
    assert form is not None, page.text
    assert browser.post(form[1], data={"xsrf": form[2], "logout": "yes"}).status_code < 400
