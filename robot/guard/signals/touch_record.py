"""Record of the touches that an arm reacts to: how firm each was, where they are, and which rule holds. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.robot.reaction.rules import RuleSet
from coneskin.robot.reaction.types import ContactOnLink, Reaction

from .contact import Contact

__all__ = ["TouchRecord"]


class TouchRecord:
    """Record of the touches since one came to an arm that nothing touched.

    Args:
        rules: reactions of the scene.

    Attributes:
        rules: the same.
        contacts: touches that there are now, by every frame.
        placed: the same, as last seen while the arm stopped.
    """

    def __init__(self, rules: RuleSet) -> None:
        self.rules = rules
        self.contacts: Sequence[ContactOnLink] = ()
        self.placed: Sequence[ContactOnLink] = ()
        self._speed = math.inf  # of the leading joint when the first began [rad/s]
        self._levels: dict[int, float] = {}  # link -> firmest
        self._newest: Sequence[Contact] = ()

    @property
    def all_placed(self) -> bool:
        """True where the place of every touch is certain."""
        return all(contact.location_valid for contact in self.placed)

    def begin(self, contact: Contact, speed: float) -> None:
        """Forget the touches before this one, which came at a speed of the leading joint [rad/s]."""
        self._speed, self._levels = speed, {contact.where.link: contact.touch.level}

    def note(self, contact: Contact) -> Reaction:
        """Take how firm a touch is now, and return the reaction to it."""
        link, level = contact.where.link, contact.touch.level
        if level > self._levels.get(link, 0.0):
            self._levels[link] = level
        return self.rules.choose(link, level, self._speed)

    def follow(self, contacts: Sequence[Contact], stopping: bool) -> None:
        """Take what the newest frame says of every touch that there is; ``stopping`` while the arm stops."""
        self._newest = contacts
        self.contacts = [contact.on_link() for contact in contacts]
        if contacts and stopping:  # a touch that fades keeps the place that it had; a firm one must have it now
            before = {contact.number: contact for contact in self.placed}
            self.placed = [
                contact
                if contact.location_valid or contact.level >= contact.firm
                else before.get(contact.number, contact)
                for contact in self.contacts
            ]

    def find(self, number: int) -> Contact | None:
        """Return the touch with this number, or the firmest there is; None where nothing touches."""
        return max(self._newest, key=lambda contact: (contact.number == number, contact.touch.level), default=None)

    def hardest(self) -> Reaction:
        """Return the reaction to all of them, each as firm as it has been."""
        return self.rules.hardest(self._levels.items(), self._speed)
