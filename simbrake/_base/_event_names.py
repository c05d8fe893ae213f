"""The events that a log can name, each with its meaning and the brakes that can have it."""

from typing import NamedTuple


class EventMeaning(NamedTuple):
    """What an event of the log means, and which brakes can have it."""

    meaning: str
    brakes: str


_ANY, _BAND, _STAGED = "every brake", "a band as a whole", "staged brake"
_NO_CHAIN = "every brake but the resolved chain"
_CHAIN, _RESOLVED, _HEAT = "resolved chain", "resolved bandage", "any brake with heat"

#: every name that an `Event` can have; a lining is named beside it where the event concerns one
EVENTS = {
    "slip_onset": EventMeaning(
        "t0: the band is taut, `C x = T_0` (rigid band, pads, shoes: the lever pulls)", _NO_CHAIN
    ),
    "lining_limit": EventMeaning(
        "lining `i` reaches its friction limit, `T_n/T_0 = Π_i` (reversed: counted from the anchor); a mark",
        _BAND,
    ),
    "full_slip": EventMeaning("t1: every lining slides, `T_n = T_0 Π` (reversed: `T_0/Π`)", _ANY),
    "restick": EventMeaning("the slip speed came to 0 while the pulley turns", "elastic band, chain"),
    "stop": EventMeaning("the pulley came to rest and is held", _ANY),
    "restart": EventMeaning(
        "the load exceeded the static limit of a brake at rest, or the grip fell below the load", _ANY
    ),
    "release": EventMeaning("the force of the lever fell to 0, the brake is open", _NO_CHAIN),
    "internal_slip": EventMeaning("the linings begin to slide on the rim", _STAGED),
    "internal_restick": EventMeaning("the linings stick to the turning rim again, `ω_b = ω`", _STAGED),
    "external_lock": EventMeaning("the bandage comes to rest on a turning pulley, `ω_b = 0`", _STAGED),
    "external_release": EventMeaning("the bandage comes loose from the band again", _STAGED),
    "lining_slip": EventMeaning("lining `i` lets go of the rim", _CHAIN),
    "lining_stick": EventMeaning("lining `i` sticks to the rim", _CHAIN),
    "lining_internal_slip": EventMeaning("lining `i` lets go of the rim", _RESOLVED),
    "lining_internal_stick": EventMeaning("lining `i` sticks to the rim", _RESOLVED),
    "lining_external_slip": EventMeaning("lining `i` lets go of the band", _RESOLVED),
    "lining_external_stick": EventMeaning("lining `i` comes to rest on the band", _RESOLVED),
    "permissible_temperature": EventMeaning(
        "the surface of the linings (of lining `i`, where each has its own) exceeded `Heat.permissible`; a mark", _HEAT
    ),
    "grip_lost": EventMeaning(
        "sliding, while the lever is not being released, the brake no longer outweighs the load; a mark",
        "standard brake whose friction depends on temperature",
    ),
    "self_locking": EventMeaning(
        "`f tan(β/2)` of a lining reached 1: it does not slip while that lasts; a mark",
        "elastic band whose friction varies in the run",
    ),
}
