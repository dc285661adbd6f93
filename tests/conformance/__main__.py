"""``python -m tests.conformance [GROUP...]``: record in the case files what real launch does, per distribution.

Needs the sources of real launch (see ``upstream``). Rewrites only the ``expect`` sections.
"""

from __future__ import annotations

import sys
from pathlib import Path

from . import case_files, public_api, upstream


def main(groups: list[str]) -> None:
    if groups == ["api"]:
        return record_api()
    for path in sorted(case_files.CASES.glob("*.txt")):
        if not groups or path.stem in groups:
            record(path)


def record(path: Path) -> None:
    cases = case_files.load(path)
    answers = {
        distro: upstream.run_all(cases, distro)
        for distro in case_files.DISTROS
        if upstream.sources(distro) is not None
    }
    if not answers:
        raise SystemExit("no sources of real launch given: see tests/conformance/upstream.py")
    blocks = ("\n" + path.read_text(encoding="utf-8")).split("\n=== ")
    number = 0
    for index, block in enumerate(blocks[1:], start=1):
        if block.split("\n", 1)[0].strip() == "shared":
            continue
        blocks[index] = _with_expectations(
            block, {distro: texts[number] for distro, texts in answers.items()}
        )
        number += 1
    path.write_text("\n=== ".join(blocks).lstrip("\n"), encoding="utf-8")
    print(f"{path.stem}: {len(cases)} cases")


def record_api() -> None:
    """Write ``public_api.txt``: one line for each name, with the distributions that have it so."""
    lines: dict[str, list[str]] = {}
    for distro in case_files.DISTROS:
        for name, parameters in upstream.api(distro).items():
            lines.setdefault(public_api.line(name, parameters), []).append(distro)
    everywhere = list(case_files.DISTROS)
    text = "".join(
        f"{line}{'' if distros == everywhere else '  @ ' + ' '.join(distros)}\n"
        for line, distros in sorted(lines.items())
    )
    public_api.RECORDED.write_text(text, encoding="utf-8")


def _with_expectations(block: str, answers: dict[str, str]) -> str:
    sections = ("\n" + block).split("\n--- ")
    kept = [section for section in sections if not section.startswith("expect")]
    kept[-1] = kept[-1].rstrip()
    if len(set(answers.values())) == 1:
        kept.append("expect\n" + next(iter(answers.values())))
    else:
        kept += [f"expect {' '.join(distros)}\n{text}" for text, distros in _grouped(answers).items()]
    return "\n--- ".join(kept).lstrip("\n") + "\n"


def _grouped(answers: dict[str, str]) -> dict[str, list[str]]:
    grouped: dict[str, list[str]] = {}
    for distro in reversed(list(answers)):
        grouped.setdefault(answers[distro], []).append(distro)
    return grouped


if __name__ == "__main__":
    main(sys.argv[1:])
