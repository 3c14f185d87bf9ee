"""Texts that would end what they stand in, and do something, in some language."""

from __future__ import annotations

CANARY = "fsmkit_canary"
"""The file that each payload would create, or the symbol that it would define."""
IN_C = (
    f"int creat(const char*,unsigned);static void __attribute__((constructor)) {CANARY}(void)"
    f'{{creat("{CANARY}",438);}}'
)
IN_PYTHON = f"open('{CANARY}','w').close()"
IN_JAVASCRIPT = f"process.getBuiltinModule('fs').writeFileSync('{CANARY}','')"
IN_SHELL = f"touch {CANARY}"

PAYLOADS = {
    "end of comment": f"x*/ {IN_C} /*",
    "lines of C": f"x*/\n#ifndef Q\n#define Q\n{IN_C}\n#endif\n/*",
    "end of line": f"x\n{IN_C}\n//",
    "return": f"x\r{IN_C}\r",
    "line separator": f"x\u2028{IN_PYTHON}\u2029\x85{IN_PYTHON}\n",
    "backslash at the end": "x\\",
    "quote": f'x"); system("{IN_SHELL}"); ("',
    "string of C": f'x";}} {IN_C} void f(void) {{ char *s = "',
    "string of Python": f"x'+__import__('os').system('{IN_SHELL}')+'",
    "string of JavaScript": f'x";{IN_JAVASCRIPT};"${{{IN_JAVASCRIPT}}}`//</script>',
    "line of JavaScript": f"x\u2028{IN_JAVASCRIPT}\u2029{IN_JAVASCRIPT}\n{IN_JAVASCRIPT}\r",
    "docstring": f'x"""\n{IN_PYTHON}\n"""',
    "braces": f"{{{IN_PYTHON}}} {{0}} {{{{x}}}} %s%n%d {{",
    "percent": "%n%n%s%s%d%",
    "shell": f"$({IN_SHELL}) `{IN_SHELL}` ; {IN_SHELL} | {IN_SHELL} & $(shell {IN_SHELL})",
    "trigraphs": f"x??/\n{IN_C}//??/",
    "end of xml": f"x]]>--></a><system>{IN_C}</system><!--",
    "plantuml": f'x\n@enduml\n@startuml\n!include {CANARY}\n%load_json("{CANARY}")',
    "mermaid": f"x\nend\nclick s1 call {CANARY}()\n%%{{init: {{}}}}%% <script>{IN_PYTHON}</script>",
    "markup": f"[/red][link=file:///{CANARY}]<b>&amp;<img src='{CANARY}'/>[bold",
    "bidirectional": "x\u202e\u2066 } if (admin) \u2069 \u2066 begin \u200f\ufeff",
    "escapes": 'x\\n\\"\\u0022\\x22\\0\\101 \\',
    "control": "x\x01\x1b]0;t\x07\x7f\x9b31m\x0b\x0c",
    "promela": f'x */ c_code {{ system("{IN_SHELL}"); }} /*',
    "cspm": f'x\n-- {{- -}} include "{CANARY}"\nassert STOP',
    "blank": " ",
    "digit": "1",
    "unicode": "äß\N{GREEK SMALL LETTER ALPHA}\U0001f600",
    "long": "x" * 5_000,
    "keyword of C": "int",
    "keyword of Python": "lambda",
    "prototype": "__proto__",
    "macro": "INT8_MAX",
    "attribute": "__attribute__((constructor))",
}
