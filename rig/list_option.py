"""An option of the command line that takes every value up to the next option: `--holdout a.h5 b.h5`."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import click


class ListOption(click.Option):
    """Takes every value up to the next option or `--`, and may be repeated. Only a ListCommand may have one."""


class ListCommand(click.Command):
    """A command that may have ListOptions, each declared with `multiple=True`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click has it. Raises BadOptionUsage for a list without a value."""
        lists = {name for param in self.params if isinstance(param, ListOption) for name in param.opts}
        return super().parse_args(ctx, list(repeated(args, lists)))


def repeated(args: Sequence[str], lists: Collection[str]) -> Iterator[str]:
    """The arguments with the option repeated before every value of its list. Raises BadOptionUsage.

    >>> list(repeated(["a", "--holdout", "b", "c", "--seed", "1", "d"], {"--holdout"}))
    ['a', '--holdout', 'b', '--holdout', 'c', '--seed', '1', 'd']
    >>> list(repeated(["--holdout=b", "c", "--", "a"], {"--holdout"}))
    ['--holdout=b', '--holdout', 'c', '--', 'a']
    """
    end = args.index("--") if "--" in args else len(args)
    within = ""
    for at, each in enumerate(args[:end]):
        if not _is_option(each):
            yield from (within, each) if within else (each,)
            continue
        name = each.partition("=")[0]
        within = name if name in lists else ""
        if not within or "=" in each:
            yield each
        elif at + 1 == end or _is_option(args[at + 1]):
            raise click.BadOptionUsage(name, f"{name} needs a value, and may have several.")
    yield from args[end:]


def _is_option(text: str) -> bool:
    return text.startswith("-") and text != "-"
