from ._log import ROLES as ROLES
from ._log import Channel as Channel
from ._log import Log as Log
from ._log import read as read
