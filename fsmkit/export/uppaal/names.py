"""Words and names that are taken (docs.uppaal.org, Reserved Keywords and Built-in Functions)."""

from __future__ import annotations

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
