"""Words, characters, colours and symbols of small oscillations."""

from sweeps.systems.presentation.look import Look, Symbol

LOOK = Look(symbols={"epsilon": Symbol(r"$\varepsilon$", "ε"), "phase": Symbol(r"$\varphi$", "φ")})
