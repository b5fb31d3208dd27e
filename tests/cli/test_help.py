"""Help fits a screen, and an option means the same in every command."""

from collections import defaultdict

import click
import pytest

from bemkit.cli.main import commands


def every_command() -> dict[str, click.Command]:
    """Return all commands and those of groups, by what is typed for them."""
    context, found = click.Context(commands), {"": commands}
    for name in commands.list_commands(context):
        command = commands.get_command(context, name)
        assert command is not None
        found[name] = command
        if isinstance(command, click.Group):
            found |= {f"{name} {word}": inner for word, inner in command.commands.items()}
    return found


COMMANDS = every_command()


@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_a_screen_of_40_lines(name: str, width: int) -> None:
    context = click.Context(COMMANDS[name], info_name=f"bemkit {name}", terminal_width=width)
    assert len(COMMANDS[name].get_help(context).splitlines()) <= 40


def options_by_name() -> dict[str, dict[str, tuple[object, ...]]]:
    found: dict[str, dict[str, tuple[object, ...]]] = defaultdict(dict)
    for name, command in COMMANDS.items():
        for option in command.params:
            if isinstance(option, click.Option):
                meaning = (option.help, option.metavar, option.type.name, option.is_flag, option.multiple)
                for word in (*option.opts, *option.secondary_opts):
                    found[word][name] = meaning
    return found


def test_an_option_means_the_same_in_every_command() -> None:
    for word, meanings in options_by_name().items():
        if word not in {"-o", "--output"}:
            assert len(set(meanings.values())) == 1, f"{word}: {meanings}"
        else:
            assert all(str(meaning[0]).startswith(("Write", "Draw")) for meaning in meanings.values())


def test_every_option_has_a_sentence() -> None:
    for word, meanings in options_by_name().items():
        for name, (text, *_) in meanings.items():
            assert str(text)[0].isupper(), f"{name} {word}: {text}"
            assert str(text).endswith("."), f"{name} {word}: {text}"
