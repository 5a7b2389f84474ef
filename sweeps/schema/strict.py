"""The base of all models of a definition."""

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """A frozen model that converts nothing and knows no other keys than its own; made ready when it is first used.

    A default that is a model is given by `model_construct`, which uses none.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)
