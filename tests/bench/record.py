"""docs/measured.md: the last full table of every group, with the command that makes it again."""
import pathlib

HEAD = """# What was measured

Each table is what `./dev bench GROUP --record` printed the last time it ran in full. Nothing here is written by hand.
"""


def section(group, record):
    lines = [line for line in record["lines"] if line["group"] == group]
    mark = {True: "yes", False: "**NO**", None: "-"}
    held = [line["ok"] for line in lines]
    rows = "".join(f"| {line['what']} | {line['asked']} | {line['measured']} | {mark[line['ok']]} |\n" for line in lines)
    return (f"\n## {group}\n\n`./dev bench {group}` on commit {record['commit']}, {record['cores']} cores, simulation profile "
            f"{(record['profile'] or 'none')[:12]}: {held.count(True)} held, {held.count(False)} fell short, "
            f"{held.count(None)} not measured.\n\n| what | asked | measured | ok |\n|---|---|---|---|\n{rows}")


def write(path: pathlib.Path, groups, record):
    """Replaces the sections of `groups`, keeps the others."""
    parts = path.read_text().split("\n## ") if path.is_file() else [""]
    kept = {part.split("\n", 1)[0]: "\n## " + part for part in parts[1:]}
    kept.update({group: section(group, record) for group in groups})
    path.write_text(HEAD + "".join(kept[group].rstrip("\n") + "\n" for group in sorted(kept)))
