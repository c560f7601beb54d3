"""`racecraft serve`: the console in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.app import Json, app, print_json
from racecraft.errors import ConfigError
from racecraft.extras import needed_for

if TYPE_CHECKING:
    from racecraft.serve.provider_settings import ProviderSettings

Database = Annotated[
    str,
    typer.Option(
        "--database",
        envvar="RACECRAFT_DATABASE",
        help="The console's: postgresql+psycopg://… instead of SQLite in its runs folder.",
    ),
]
Artifacts = Annotated[
    str,
    typer.Option(
        "--artifacts", envvar="RACECRAFT_ARTIFACTS", help="s3://BUCKET/PREFIX or file:///FOLDER to copy runs to."
    ),
]
Trainings = Annotated[
    int, typer.Option("--trainings", help="At the same time on this machine; 0 leaves them to workers elsewhere.")
]
Others = Annotated[int, typer.Option("--others", help="The same for evaluations and other short jobs.")]


@app.command()
def serve(
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    port: Annotated[int, typer.Option("--port", "-p", help="Of 127.0.0.1; 0 takes a free one.")] = 8321,
    database: Database = "",
    artifacts: Artifacts = "",
    trainings: Trainings = 1,
    others: Others = 1,
    league: Annotated[bool, typer.Option("--league", help="Let others have accounts; you are their admin.")] = False,
    host: Annotated[str, typer.Option("--host", help="Address to listen at; another one than this in a league.")] = (
        "127.0.0.1"
    ),
    address: Annotated[
        str, typer.Option("--address", help="https://NAME or http://NAME:PORT by which others call the league.")
    ] = "",
    plain_http: Annotated[
        bool, typer.Option("--plain-http", help="Let passwords and cards cross the network unencrypted.")
    ] = False,
    trusted_proxy: Annotated[
        list[str], typer.Option("--trusted-proxy", help="Address or network of a proxy that is believed who calls.")
    ] = [],  # noqa: B006 (Typer copies it)
    certificate: Annotated[
        Path | None, typer.Option("--certificate", help="PEM file of your own, where no proxy has one.")
    ] = None,
    key: Annotated[Path | None, typer.Option("--key", help="PEM file with the certificate's private key.")] = None,
    provider: Annotated[
        str, typer.Option("--provider", help="https://… of a school or company, through which people sign in.")
    ] = "",
    provider_client: Annotated[
        str, typer.Option("--provider-client", help="Client id that the provider gave the league.")
    ] = "",
    provider_secret_file: Annotated[
        Path | None,
        typer.Option("--provider-secret-file", help="File with its secret, unless RACECRAFT_PROVIDER_SECRET has it."),
    ] = None,
    provider_name: Annotated[
        str, typer.Option("--provider-name", help="What the button calls the provider, such as 'Hill School'.")
    ] = "",
    provider_domain: Annotated[
        list[str], typer.Option("--provider-domain", help="Of e-mail addresses that come in; none lets in all.")
    ] = [],  # noqa: B006
    provider_claim: Annotated[
        list[str], typer.Option("--provider-claim", help="NAME=VALUE that the provider has to say of who comes in.")
    ] = [],  # noqa: B006
    provider_group: Annotated[
        int | None, typer.Option("--provider-group", help="Number of the group that newcomers join.")
    ] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the link in a browser.")] = True,
    as_json: Json = False,
) -> None:
    """Open the console in a browser: train, watch and race."""
    from racecraft.serve.quick import loading

    with needed_for("The console"), loading():
        from racecraft.serve import ServeSettings
        from racecraft.serve import serve as run_server
        from racecraft.serve.submissions.walls import missing_walls

    def ready(link: str) -> None:
        also = f"{address.rstrip('/')}/?{link.partition('?')[2]}" if address else link
        if as_json:
            print_json({"link": link, "by_address": also})
        else:
            other = f"\nor, by its address, at {also}" if also != link else ""
            typer.echo(f"The console is open at {link}{other}\nThe link works once. Ctrl-C stops the console.")
        if league and (lacks := missing_walls()):
            typer.echo(f"Entries of others are judged behind fewer walls: the system has no {lacks}.", err=True)
        if browser and not as_json:
            import webbrowser

            webbrowser.open(link)

    named = (provider_client, provider_secret_file, provider_name, provider_domain, provider_claim)
    if not provider and (any(named) or provider_group is not None):
        raise ConfigError("There is no provider that these options are of.", hint="Give its address with --provider.")
    settings = ServeSettings(
        runs=runs,
        port=port,
        database=database,
        artifacts=artifacts,
        training_slots=trainings,
        other_slots=others,
        league=league,
        host=host,
        address=address,
        plain_http=plain_http,
        trusted_proxies=tuple(trusted_proxy),
        certificate=certificate,
        key=key,
        provider=_provider_settings(
            provider,
            client=provider_client,
            secret_file=provider_secret_file,
            label=provider_name,
            domains=provider_domain,
            claims=provider_claim,
            group=provider_group,
        ),
    )
    run_server(settings, on_ready=ready)


def _provider_settings(
    issuer: str,
    *,
    client: str,
    secret_file: Path | None,
    label: str,
    domains: list[str],
    claims: list[str],
    group: int | None,
) -> ProviderSettings | None:
    from racecraft.serve.provider_settings import ProviderSettings, claim_of, secret_of

    if not issuer:
        return None
    return ProviderSettings(
        issuer=issuer,
        client=client,
        secret=secret_of(secret_file),
        label=label,
        domains=tuple(domains),
        claims=tuple(claim_of(claim) for claim in claims),
        group=group,
    )


@app.command()
def worker(
    runs: Annotated[
        Path, typer.Option("--runs", help="Folder for the runs that are worked on; not the console's own.")
    ] = Path("worker-runs"),
    server: Annotated[
        str, typer.Option("--server", envvar="RACECRAFT_SERVER", help="Address of the console: https://NAME.")
    ] = "",
    token_file: Annotated[
        Path | None,
        typer.Option("--token-file", envvar="RACECRAFT_TOKEN_FILE", help="File with a worker's token from there."),
    ] = None,
    plain_http: Annotated[
        bool, typer.Option("--plain-http", help="Let the token cross the network unencrypted.")
    ] = False,
    database: Database = "",
    artifacts: Artifacts = "",
    trainings: Trainings = 1,
    others: Others = 1,
    machine: Annotated[
        str, typer.Option("--machine", help="Name of this one; made from the host's name by default.")
    ] = "",
    as_json: Json = False,
) -> None:
    """Work for a console on another machine, until Ctrl-C.

    By its address and a token, or by its database and object store.
    """
    from racecraft.serve.quick import loading

    with needed_for("A worker"), loading():
        from racecraft.serve.settings import ServeSettings
        from racecraft.serve.station import work_for, work_through

    if (server == "") != (token_file is None) or (server and (database or artifacts)):
        raise ConfigError("Give --server with --token-file, or --database with --artifacts.")
    settings = ServeSettings(
        runs=runs,
        database=database,
        artifacts=artifacts,
        training_slots=trainings,
        other_slots=others,
        machine=machine,
    )

    def ready() -> None:
        if as_json:
            print_json({"machine": settings.machine})
        else:
            typer.echo(f"{settings.machine} works for the console. Ctrl-C saves what is under way and stops.")

    if token_file is not None:
        work_through(server, token_file, settings, on_ready=ready, plain_http=plain_http)
    else:
        work_for(settings, on_ready=ready)
