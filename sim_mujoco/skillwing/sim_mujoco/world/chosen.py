"""Which site a node of the functional layer flies over, where its options name one instead of describing it."""

from __future__ import annotations

import msgspec

from skillwing.services.options import OptionsError
from skillwing.sim_mujoco.world.site import Site


class SiteOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A site as an option of a node: `{"seed": 1, "kind": "village"}`, made as the simulator makes its own."""

    seed: int = 1
    kind: str = "courtyard"

    def site(self) -> Site:
        """What is known of it beforehand. Raises OptionsError for a kind that there is not, and a negative seed."""
        from skillwing.sim_mujoco.world.kinds import make_site  # noqa: PLC0415 - numpy, which the usual site spares

        try:
            return make_site(self.seed, self.kind)
        except ValueError as error:
            raise OptionsError(str(error)) from error
