"""A fit result as one HTML file that works offline: for reading, printing and archives.

    from fitting.report import Reported, page
    html = page([Reported(result, measurement)])

`sections` says what is reported, in `blocks`; `figures` draws; `page` puts all of it into
``templates/page.html``, where everything is escaped, so that no text of a file is taken for
HTML. jinja2 is only needed then, and matplotlib for the figures.
"""

from fitting.report.page import ReportMissing, page, require
from fitting.report.reported import Reported

__all__ = ["ReportMissing", "Reported", "page", "require"]
