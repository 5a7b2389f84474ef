"""Words, characters, colours and symbols of small oscillations."""

from sweeps.systems.look import Look, Symbol

LOOK = Look(symbols={"epsilon": Symbol(r"$\varepsilon$", "ε"), "phase": Symbol(r"$\varphi$", "φ")})
