"""How the flags and the nudge of small oscillations look."""

from sweeps.systems.look import Look, Symbol

LOOK = Look(symbols={"epsilon": Symbol(r"$\varepsilon$", "ε"), "phase": Symbol(r"$\varphi$", "φ")})
