"""Words that are reserved in UPPAAL, or in a tool that reads its files."""

from __future__ import annotations

WORDS = """
    A abs acos acosh after_update and asin asinh assert assign atan atan2 atanh before_update
    bool bounds branchpoint break broadcast case cbrt ceil chan clock commit const continue
    control control_t copysign cos cosh DBL_MAX DBL_MIN deadlock default do double dynamic E
    else enum erf erfc exists exit exp exp2 expm1 fabs false fdim fint floor FLT_MAX FLT_MIN fma
    fmax fmin fmod for forall foreach fpclassify gantt guard hybrid hypot if ilogb imitate imply
    import in inf init input int INT16_MAX INT16_MIN int16_t INT32_MAX INT32_MIN int32_t
    INT8_MAX INT8_MIN int8_t invariant IO isfinite isinf isnan isnormal isunordered ldexp lgamma
    ln loadStrategy location log log10 log1p log2 logb M M_1_PI M_2_PI M_2_SQRTPI M_E M_LN10
    M_LN2 M_LOG10E M_LOG2E M_PI M_PI_2 M_PI_4 M_SQRT1_2 M_SQRT2 max maxE maxPr meta min minE
    minPr nextafter not numOf or output Pmax pow Pr priority probability process progress query
    R random random_arcsine random_beta random_gamma random_normal random_poisson random_tri
    random_weibull rate refinement return round sat save saveStrategy scalar select signbit
    simulate simulation sin sinh spawn sqrt state strategy string struct sum sup switch sync
    system tan tanh tgamma then trans true trunc typedef typename U UINT16_MAX uint16_t
    UINT32_MAX uint32_t UINT8_MAX uint8_t under urgent void W while X xor
"""
RESERVED = frozenset(WORDS.split())
"""Keywords of models and of queries, built-in functions, and constants and types that are declared
before each model. docs.uppaal.org lists most (Reserved Keywords, Built-in Functions); the others
are in the open parser of UPPAAL 5. Case counts: ``Pr`` is reserved, ``pr`` is not."""

_TCHECKER = """
    clock do edge else end event if int local location nop process sync system then while
"""
FLAT = RESERVED | frozenset(_TCHECKER.split())
"""For the flat form also the keywords of TChecker, to which others translate it."""
