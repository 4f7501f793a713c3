"""docs/measured.md: the last table of every group, with the command that repeats it; --long has its own table."""
import pathlib
import re

HEAD = """# What was measured

Each table is what `./dev bench GROUP --record` printed the last time, with samples; those of `--long` hold everything
and are kept apart. A line measured again by itself (`--only PART`) names its commit. Nothing here is written by hand.
"""


MARK = {True: "yes", False: "**NO**", None: "-"}


def row(line):
    return [str(line["what"]), str(line["asked"]), str(line["measured"]), MARK[line["ok"]]]


def counted(rows):
    held = [mark for *_, mark in rows]
    return f"{held.count('yes')} held, {held.count('**NO**')} fell short, {held.count('-')} not measured."


def table(rows):
    return "\n\n| what | asked | measured | ok |\n|---|---|---|---|\n" + "".join(f"| {' | '.join(r)} |\n" for r in rows)


def title(group, record):
    return group + (", long" if record["long"] else "")


def section(group, record):
    command = f"./dev bench {group}" + (" --long" if record["long"] else "")
    rows = [row(line) for line in record["lines"] if line["group"] == group]
    return (f"\n## {title(group, record)}\n\n`{command}` on commit {record['commit']}, {record['cores']} cores, simulation profile "
            f"{(record['profile'] or 'none')[:12]}: {counted(rows)}{table(rows)}")


def amended(text, group, record):
    """Section `text` in which lines of `record` replace those of the same name; later lines are marked as such."""
    head, _, body = text.partition("\n\n| what | asked | measured | ok |\n|---|---|---|---|\n")
    rows = [line.strip("| ").split(" | ") for line in body.splitlines() if line.startswith("| ")]
    later = {line["what"]: row(line) for line in record["lines"] if line["group"] == group}
    mark = f" (on {record['commit']})"
    rows = [later.pop(name[0].split(" (on ")[0], None) or name for name in rows] + list(later.values())
    named = {line["what"] for line in record["lines"]}
    rows = [[name + mark if name in named else name, *rest] for name, *rest in rows]
    if all(" (on " in name for name, *_ in rows):
        head = re.sub(r" on commit \w+,", ", each line on the commit it names,", head)
    return head.rsplit(": ", 1)[0] + ": " + counted(rows) + table(rows)


def write(path: pathlib.Path, groups, record, again=False):
    """Replaces the sections of `groups`, or, measured `again` in part, their lines; keeps the others."""
    parts = path.read_text().split("\n## ") if path.is_file() else [""]
    kept = {part.split("\n", 1)[0]: "\n## " + part for part in parts[1:]}
    for group in groups:
        name = title(group, record)
        whole = not again or name not in kept
        kept[name] = section(group, record) if whole else amended(kept[name], group, record)
    path.write_text(HEAD + "".join(kept[name].rstrip("\n") + "\n" for name in sorted(kept)))
