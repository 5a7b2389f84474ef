"""The base of all models of a definition."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from sweeps.schema.refusals import keys_of


class Strict(BaseModel):
    """A frozen model that converts nothing and knows no other keys than its own; made ready when it is first used.

    A default that is a model is given by `model_construct`, which uses none: see `mapping`.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)


def key(description: str, default: Any = None) -> Any:
    """Return the field of a key, with what a refusal says of it; `...` in place of a default makes it required."""
    return Field(default, description=description)


def switch(words: str) -> Any:
    """Return the field of a key that is true or false; left out, it is false."""
    return key(f"true or false: whether {words}", False)


def mapping(words: str, model: type[Strict], required: bool = False) -> Any:
    """Return the field of a mapping, whose description lists the keys; left out, it has the model's defaults."""
    default = ... if required else model.model_construct()
    return key(f"{words}: a mapping with {keys_of(model)}", default)
