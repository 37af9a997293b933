"""A process that runs cases one after the other and notes each before it starts: `python -m fuzz.worker`.

Arguments: notes file, work folder, seed, kind or '-', and the cases' numbers. Each note is a line of JSON.
"""

from __future__ import annotations

import json
import shlex
import shutil
import sys
import time
from pathlib import Path


def main(notes: str, work: str, seed: str, kind: str, *numbers: str) -> None:
    """Run cases; the notes tell what is going on and what was wrong."""
    from fuzz.cases import make
    from fuzz.judge import problems_in, problems_of

    with open(notes, "a", encoding="utf-8") as file:

        def note(**what: object) -> None:
            file.write(json.dumps(what) + "\n")
            file.flush()

        for number in map(int, numbers):
            folder = Path(work) / f"case_{seed}_{number}"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            note(begin=number, command="making the input")
            bad = False
            for argv in make(folder, int(seed), number, "" if kind == "-" else kind):
                if argv[0] == "explain" and not (folder / "out" / "result.nc").is_file():
                    continue
                note(begin=number, command=shlex.join(argv))
                start = time.perf_counter()
                code, found = problems_of(argv)
                found += problems_in(folder / "out") if argv[0] == "run" else []
                took = time.perf_counter() - start
                note(done=number, command=argv[0], code=code, seconds=round(took, 3), problems=found)
                bad |= bool(found)
            note(end=number)
            if not bad:
                shutil.rmtree(folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
