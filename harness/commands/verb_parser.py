"""The parser of a command line: each complaint is an error of one line, with the nearest verb, flag or choice."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import Any, NoReturn

from harness.errors import BadInput, UnknownName


class VerbParser(argparse.ArgumentParser):
    """Raises UnknownName and BadInput where argparse prints the usage and exits."""

    def parse_known_args(  # type: ignore[override]  # argparse has overloads for other namespaces
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        words = list(sys.argv[1:] if args is None else args)
        self._check_flags(takewhile(lambda word: word.startswith("-"), words) if self._subparsers else words)
        parsed, rest = super().parse_known_args(words, namespace)
        if rest:
            self._check_flags(rest, dashes="-")
            raise BadInput(f"`{self.prog}` has no place for '{rest[0]}'.", self._advice())
        return parsed, rest

    def _check_flags(self, words: Iterable[str], dashes: str = "--") -> None:
        """UnknownName for the first flag that the parser does not have; argparse accepts the beginning of a flag."""
        flags = [flag for action in self._actions if action.help != argparse.SUPPRESS for flag in action.option_strings]
        for word in takewhile(lambda word: word != "--", words):
            name = word.partition("=")[0]
            known = " " in name or any(flag.startswith(name) for flag in self._option_string_actions)
            if word.startswith(dashes) and not known:
                raise UnknownName(f"flag of `{self.prog}`", name, [flag for flag in flags if flag.startswith("--")])

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            names = action.option_strings or [str(action.metavar or action.dest).lower()]
            kind = f"choice of {names[-1]}" if action.option_strings else names[0]
            raise UnknownName(kind, str(value), map(str, action.choices))

    def error(self, message: str) -> NoReturn:
        """BadInput with argparse's complaint."""
        text = message.removeprefix("argument ").replace("the following arguments are required: ", "it needs ")
        text = text.replace("invalid int value: ", "not a whole number: ").replace(
            "invalid float value: ", "not a number: "
        )
        advice = self._advice()
        if "expected" in message:
            advice = f"A value that begins with '-' follows '=', as in --flag=-1. {advice}"
        raise BadInput(f"`{self.prog}`: {text}.", advice)

    def _advice(self) -> str:
        return f"See `{self.prog} --help`."
