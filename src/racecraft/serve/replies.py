"""Every error of the console's server has one JSON shape: {"error": {code, message, hint, line, field}}."""

from __future__ import annotations

import errno
import logging
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import DataError, DBAPIError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from racecraft.errors import RacecraftError, TrackNotFound
from racecraft.serve.problems import Conflict, NotFound, NotLetIn, TooMany, Unreachable

STATUS: Final = {NotFound: 404, TrackNotFound: 404, Conflict: 409, NotLetIn: 401, TooMany: 429, Unreachable: 502}
"""Of errors that are not simply something wrong with the request, which is 422."""


def problem(status: int, code: str, message: str, hint: str = "", **more: Any) -> JSONResponse:
    """An error reply."""
    return JSONResponse({"error": {"code": code, "message": message, "hint": hint, **more}}, status_code=status)


def install(app: FastAPI) -> None:
    """Teach the application to tell errors."""

    @app.exception_handler(RacecraftError)
    async def told(_: Request, error: RacecraftError) -> JSONResponse:
        status = next((status for kind, status in STATUS.items() if isinstance(error, kind)), 422)
        return problem(status, type(error).__name__, str(error), error.hint, line=getattr(error, "line", None))

    @app.exception_handler(RequestValidationError)
    async def not_valid(_: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"] if part not in ("body", "query", "path"))
        if isinstance(told := first.get("ctx", {}).get("error"), RacecraftError):
            return problem(422, "InvalidRequest", str(told), told.hint, field=field or None)
        text = f"{field or 'The request'}: {first['msg']}.".replace("..", ".")
        return problem(422, "InvalidRequest", text, field=field or None)

    @app.exception_handler(HTTPException)
    async def refused(_: Request, error: HTTPException) -> JSONResponse:
        return problem(error.status_code, "Refused", str(error.detail))

    @app.exception_handler(DataError)
    async def not_storable(_: Request, error: DataError) -> JSONResponse:
        return problem(422, "InvalidRequest", f"The database does not take this: {str(error.orig).splitlines()[0]}.")

    @app.exception_handler(DBAPIError)
    async def no_database(_: Request, error: DBAPIError) -> JSONResponse:
        logging.getLogger("racecraft.serve").error("The database fails: %s", str(error).splitlines()[0])
        return problem(503, "Database", "The console's database does not answer.", "Try again in a moment.")

    @app.exception_handler(ClientDisconnect)
    async def gone(_: Request, __: ClientDisconnect) -> JSONResponse:
        return problem(400, "Disconnected", "The request broke off.")

    @app.exception_handler(OSError)
    async def too_long(_: Request, error: OSError) -> JSONResponse:
        if error.errno != errno.ENAMETOOLONG:
            raise error
        return problem(404, "NotFound", "Nothing here has so long a name.")  # whatever a stranger asked for by it

    @app.exception_handler(Exception)
    async def broken(request: Request, error: Exception) -> JSONResponse:
        logging.getLogger("racecraft.serve").error("%s %s", request.method, request.url.path, exc_info=error)
        return problem(500, "Bug", "Something broke in the console.", "The server's terminal shows where.")
