"""Names that UPPAAL accepts, as near to those of the charts as may be."""

from __future__ import annotations

import re

WORDS = """
    A E U W R M and assign before_update after_update bool branchpoint break broadcast case chan
    clock commit const continue control deadlock default do double dynamic else enum exit exists
    false for forall foreach gantt guard hybrid if imply import in inf init input int invariant
    IO location max meta min not numOf or output priority probability process progress query
    rate refinement return save scalar select simulate simulation spawn state string strategy
    struct sum sup switch sync system then trans true typedef typename under urgent void while
    bounds loadStrategy saveStrategy minE maxE minPr maxPr int8_t uint8_t int16_t uint16_t
    int32_t INT8_MIN INT8_MAX UINT8_MAX INT16_MIN INT16_MAX UINT16_MAX INT32_MIN INT32_MAX
    FLT_MIN FLT_MAX DBL_MIN DBL_MAX M_PI M_PI_2 M_PI_4 M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_1_PI
    M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2 abs fabs fmod fma fmax fmin exp exp2 expm1 ln log log10
    log2 log1p pow sqrt cbrt hypot sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh
    atanh erf erfc tgamma lgamma ceil floor trunc round fint ldexp ilogb logb nextafter copysign
    fpclassify isfinite isinf isnan isnormal signbit isunordered random random_arcsine
    random_beta random_gamma random_normal random_poisson random_weibull random_tri
"""
RESERVED = frozenset(WORDS.split())
"""Words and names that are taken (docs.uppaal.org, Reserved Keywords and Built-in Functions)."""
LEGAL = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_legal(name: str) -> bool:
    """Whether UPPAAL accepts a name."""
    return LEGAL.fullmatch(name) is not None and name not in RESERVED


def spelled(name: str) -> str:
    """Return a name with only such characters as UPPAAL knows."""
    found = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return found if found and not found[0].isdigit() else f"n_{found}"


class Names:
    """Gives out names, each once; no name of ``outer`` is given."""

    def __init__(self, outer: Names | None = None) -> None:
        """Begin with none given."""
        self._taken: set[str] = set()
        self._outer = outer

    def take(self, wanted: str) -> str:
        """Return the name, or one like it if it is taken."""
        base = spelled(wanted)
        found, count = base, 1
        while found in RESERVED or self._is_taken(found):
            count += 1
            found = f"{base}_{count}" if count > 2 or base not in RESERVED else f"{base}_"
        self._taken.add(found)
        return found

    def _is_taken(self, name: str) -> bool:
        outer = self._outer
        return name in self._taken or (outer is not None and outer._is_taken(name))  # noqa: SLF001
