"""Inputs made out of good ones: tokens cut, doubled, swapped, numbers driven to extremes, brackets lost, bytes spoiled.

Everything is drawn from one `random.Random`, so that a seed repeats a run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from random import Random

Tokens = list[bytes]
PIECES = re.compile(rb"\d+\.?\d*(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|[ \t]+|.", re.DOTALL)
EXTREMES = (
    b"0", b"-0", b"-1", b"1", b"9E9", b"9E+09", b"-9E9", b"1E308", b"1E999", b"-1E999", b"1E-320", b"8388608", b"2147483648",
    b"99999999999999999999", b"0xFFFFFFFFFFFFFFFFFF", b"0b2", b"1.", b".5", b"1E", b"1e+", b"--1", b"1.2.3", b"nan", b"NaN",
    b"inf", b"-inf", b"1,5", b"1_0", b"\xd9\xa3", b"1" * 5000,
)  # fmt: skip
BRACKETS = (
    b"[",
    b"]",
    b"(",
    b")",
    b"{",
    b"}",
    b'"',
    b'""',
    b";",
    b",",
    b":=",
    b"=",
    b"!",
    b"\\",
    b"'",
    b"\n",
    b"\r\n",
    b"\r",
    b"#",
)
SPOILED = (
    b"\0",
    b"\xff",
    b"\xfe\xff",
    b"\xef\xbb\xbf",
    b"\x80",
    b"\x85",
    b"\x1a",
    b"\x0c",
    b"\xc2\xa0",
    b"\xe3\x80\x80",
    b"\xf0\x9f\x98\x80",
)
DEPTHS = (2, 3, 30, 300, 3000)


def pieces(data: bytes) -> Tokens:
    """Numbers, words, blanks and single other bytes; joined they are the input."""
    return PIECES.findall(data)


class Mutator:
    """Makes inputs of one kind.

    Args:
        seeds: good inputs, as pieces.
        words: what this kind of file is made of, put in where it does not belong.
        nests: openers that are repeated thousands of times.
    """

    def __init__(self, seeds: Sequence[bytes], words: Sequence[bytes], nests: Sequence[bytes], random: Random) -> None:
        self.seeds = [pieces(seed) for seed in seeds]
        self.words, self.nests, self.random = words, nests, random
        # Rarely useful changes are listed once, others several times.
        self.changes: list[Callable[[Tokens], None]] = [
            *[self._cut, self._double, self._swap, self._number, self._number, self._bracket, self._lose, self._word] * 4,
            self._spoil, self._spoil, self._truncate, self._splice, self._nest, self._lengthen,
        ]  # fmt: skip

    def make(self) -> bytes:
        """One input, a few changes away from a good one."""
        random = self.random
        tokens = list(random.choice(self.seeds))
        for _ in range(random.choice((1, 1, 2, 3, 5, 9))):
            random.choice(self.changes)(tokens)
        return self._encode(b"".join(tokens)) if random.random() < 0.02 else b"".join(tokens)

    def _at(self, tokens: Tokens) -> int:
        return int(self.random.random() * (len(tokens) + 1))

    def _cut(self, tokens: Tokens) -> None:
        at = self._at(tokens)
        del tokens[at : at + self.random.choice((1, 1, 2, 5, 20))]

    def _double(self, tokens: Tokens) -> None:
        at = self._at(tokens)
        part = tokens[at : at + self.random.choice((1, 1, 3, 10, 40))]
        to = self._at(tokens)
        tokens[to:to] = part

    def _swap(self, tokens: Tokens) -> None:
        if tokens:
            a, b = self._at(tokens) % len(tokens), self._at(tokens) % len(tokens)
            tokens[a], tokens[b] = tokens[b], tokens[a]

    def _number(self, tokens: Tokens) -> None:
        start = self._at(tokens)
        for at in range(start, min(start + 60, len(tokens))):
            if tokens[at][:1].isdigit():
                tokens[at] = self.random.choice(EXTREMES)
                return

    def _bracket(self, tokens: Tokens) -> None:
        tokens.insert(self._at(tokens), self.random.choice(BRACKETS))

    def _lose(self, tokens: Tokens) -> None:
        start = self._at(tokens)
        for at in range(start, min(start + 60, len(tokens))):
            if tokens[at] in BRACKETS:
                del tokens[at]
                return

    def _word(self, tokens: Tokens) -> None:
        tokens.insert(self._at(tokens), self.random.choice(self.words))

    def _spoil(self, tokens: Tokens) -> None:
        wrong = self.random.choice(SPOILED) if self.random.random() < 0.5 else bytes([self.random.randrange(256)])
        at = self._at(tokens)
        tokens[at : at + self.random.randrange(2)] = [wrong]

    def _truncate(self, tokens: Tokens) -> None:
        del tokens[self._at(tokens) :]

    def _splice(self, tokens: Tokens) -> None:
        other = self.random.choice(self.seeds)
        at = self._at(other)
        tokens[self._at(tokens) :] = other[at:]

    def _nest(self, tokens: Tokens) -> None:
        depth = self.random.choices(DEPTHS, (40, 40, 20, 4, 1))[0]
        tokens.insert(self._at(tokens), self.random.choice(self.nests) * depth)

    def _lengthen(self, tokens: Tokens) -> None:
        if tokens:
            at = self._at(tokens) % len(tokens)
            tokens[at] = (tokens[at] * self.random.choice((2, 40, 400)))[:8000]

    def _encode(self, data: bytes) -> bytes:
        text = data.decode("latin-1")
        return self.random.choice(
            (text.encode("utf-16"), text.encode("utf-16-be"), b"\xef\xbb\xbf" + data, text.encode(), data.replace(b"\n", b"\r\n"),
             data.replace(b"\n", b"\r"), data.replace(b"\n", b""), data[::-1], data.upper(), data.lower())
        )  # fmt: skip
