"""Runs a target with libFuzzer; a crash is an input that atheris writes down.

PYTHONPATH=. python devtools/fuzz/fuzz_yaml.py -max_total_time=60 -len_control=0 CORPUS
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import atheris

from devtools.fuzz.seeds import write_corpus


def fuzz(
    target: Callable[[bytes], None],
    seeds: Callable[[], Iterator[str]],
    mutate: Callable[[bytes, int, int], bytes],
    cross: Callable[[bytes, bytes, int, int], bytes],
) -> None:
    """Run a target with libFuzzer on the corpus that it is given, after filling that with seeds."""
    corpus = next((Path(word) for word in sys.argv[1:] if not word.startswith("-")), None)
    if corpus is not None and not corpus.is_file():
        write_corpus(corpus, seeds())
    atheris.Setup(sys.argv, target, custom_mutator=mutate, custom_crossover=cross)
    atheris.Fuzz()
