"""The discrete stage of the repair: pieces go where a person would try them, before boxes are moved by millimetres."""

from echousd.repair.arrange.arrange import BAD, Arranged, arrange
from echousd.repair.arrange.setting import Setting, setting_of

__all__ = ["BAD", "Arranged", "Setting", "arrange", "setting_of"]
