from ._app import App as App
from ._app import Server as Server
from ._page import film_page as film_page
from ._page import report as report
from ._page import write_run as write_run
from ._page import write_sensitivities as write_sensitivities
from ._publish import publish as publish
from ._rig import write_ledger as write_ledger
