"""ROS names and types as Zenoh key expressions. Pure text.

Source: ros2/rmw_zenoh docs/design.md and liveliness_utils.cpp; eclipse-zenoh's rules for canonical key expressions.

    <domain>/<name>/<type>/<hash>                       messages, requests and replies
    <data key>/@adv/pub/<session>/<entity>/_            history of a transient local publisher
    @ros2_lv/<domain>/<session>/<node>/<entity>/<kind>/<enclave>/<namespace>/<node>
        a node that is there; an endpoint of it where /<name>/<type>/<hash>/<qos> follows

``*`` is one chunk, ``**`` any number, ``$*`` anything within a chunk. None of them matches a chunk that begins
with ``@``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import pairwise, product

from enclave_common.terminal import quoted
from keystore.formats.domains import Domains
from keystore.formats.policy import PolicyError

_GRAPH = "@ros2_lv"
_TYPE = re.compile(r"([A-Za-z][A-Za-z0-9_]*)/(msg|srv|action)/([A-Za-z][A-Za-z0-9_]*)\Z")
_MOST_STARS = 3  # each may double the number of expressions


class NotExpressible(PolicyError):
    """A wildcard of a policy that no key expression matches exactly. The text says which and why."""


def domain_chunks(domains: Domains) -> tuple[str, ...]:
    """Return one chunk for each domain, ``*`` for all of them."""
    if domains == Domains.every():
        return ("*",)
    return tuple(str(number) for first, last in domains.ranges for number in range(first, last + 1))


def type_chunk(ros_type: str) -> str | None:
    """Return ``std_msgs/msg/String`` as ``std_msgs::msg::dds_::String_``; None for what is not such a name."""
    match = _TYPE.match(ros_type)
    return f"{match[1]}::{match[2]}::dds_::{match[3]}_" if match else None


def name_expressions(name: str) -> tuple[str, ...]:
    """Return an absolute name of a policy as chunks, without the first ``/``. ``*`` crosses ``/`` there, as in
    fnmatch.

    Raises ``NotExpressible`` for ``?``, ``[...]`` and more than three ``*`` inside of chunks.
    """
    if "*" not in name and "?" not in name and "[" not in name:
        return (name[1:],)
    if "?" in name or "[" in name:
        raise NotExpressible(f"{quoted(name)}: Zenoh has no counterpart of ? and [...]; name them one by one")
    pieces = re.split(r"\*+", name)
    stars = [_star(before, after) for before, after in pairwise(pieces)]
    if sum(len(star) > 1 for star in stars) > _MOST_STARS:
        raise NotExpressible(
            f"{quoted(name)}: more than {_MOST_STARS} * inside of its parts; name them one by one"
        )
    texts = ("".join(map("".join, zip(pieces, (*chosen, ""), strict=True))) for chosen in product(*stars))
    return tuple(sorted({_canonical(text[1:]) for text in texts}))


def _star(before: str, after: str) -> tuple[str, ...]:
    """Return what a ``*`` between these texts can be: within its chunk, or across some."""
    if before.endswith("/") and (not after or after.startswith("/")):
        return ("*/**",)
    if not after:
        return ("$*/**",)
    return ("$*", "$*/**/$*")


def _canonical(expression: str) -> str:
    """Write in the only spelling that Zenoh accepts: ``**/*`` is ``*/**``, ``$*`` alone is ``*``."""
    chunks: list[str] = []
    run: list[str] = []
    for chunk in (*expression.split("/"), ""):
        plain = re.sub(r"(?:\$\*)+", "$*", chunk)
        plain = "*" if plain == "$*" else plain
        if plain in ("*", "**"):
            run.append(plain)
            continue
        chunks += [each for each in run if each == "*"] + ["**"] * ("**" in run)
        run = []
        chunks.append(plain)
    return "/".join(chunks[:-1])


def data_keys(domains: Iterable[str], name: str, types: Iterable[str]) -> Iterator[str]:
    """Return the keys of a topic or service: ``types`` are chunks of ``type_chunk``, none for any type.

    The hash stays open, so that a new definition of a message needs no new rules.
    """
    tails = [f"{one}/*" for one in types] or ["*/*"]
    for domain, expression, tail in product(domains, name_expressions(name), tails):
        yield _canonical(f"{domain}/{expression}/{tail}")


def history(key: str) -> str:
    """Return where a subscription requests what was published before, and what it missed."""
    return f"{key}/@adv/**"


def cache(key: str) -> str:
    """Return where a transient local publisher answers, and says that it is there."""
    return f"{key}/@adv/pub/**"


def mangled(name: str) -> str:
    """Return an absolute name as one chunk of a token: ``/front/camera`` as ``%front%camera``."""
    return name.replace("/", "%")


def node_tokens(domains: Iterable[str], enclave: str) -> Iterator[str]:
    """Return the tokens with which the nodes of an enclave say that they are there."""
    for domain in domains:
        yield f"{_GRAPH}/{domain}/*/*/*/NN/{mangled(enclave)}/*/*"


def endpoint_tokens(
    domains: Iterable[str], kind: str, enclave: str, name: str, types: Iterable[str]
) -> Iterator[str]:
    """Return the same for a publisher (``MP``), subscription (``MS``), server (``SS``) or client (``SC``)."""
    chunk = re.sub(r"\*+", "$*", mangled(name))
    tails = [f"{one}/*/*" for one in types] or ["*/*/*"]
    for domain, tail in product(domains, tails):
        yield f"{_GRAPH}/{domain}/*/*/*/{kind}/{mangled(enclave)}/*/*/{chunk}/{tail}"


def graph(domains: Iterable[str]) -> Iterator[str]:
    """Return all tokens of a domain: what rmw_zenoh requests when a context begins."""
    return (f"{_GRAPH}/{domain}/**" for domain in domains)
