"""Links of a league, and pictures of them to scan. What is secret stands behind a #, which no server ever logs."""

from __future__ import annotations

from fastapi import Request

from racecraft.serve.people.schemas import LoginCard
from racecraft.serve.settings import ServeSettings


def address_of(request: Request, settings: ServeSettings) -> str:
    """What this league is called by: as it was started with, else as this browser calls it."""
    return settings.address.rstrip("/") or f"http://{request.headers['host']}"


def picture(link: str) -> str:
    """A QR code as the address of an image."""
    import segno  # consoles without accounts do without

    return segno.make(link, error="m", micro=False).svg_data_uri(scale=4, border=4)


def card_of(address: str, secret: str, *, user_id: int, name: str) -> LoginCard:
    """A login card."""
    link = f"{address}/card#{secret}"
    return LoginCard(id=user_id, name=name, link=link, picture=picture(link))
