"""The functions of this room that the rest of the keystore calls (``keystore.add_ons``)."""

from __future__ import annotations

from keystore.add_ons import ZenohFiles
from keystore.zenoh.verification import check_zenoh
from keystore.zenoh.writing import follow, sign

ADD_ON = ZenohFiles(follow, check_zenoh, sign)
