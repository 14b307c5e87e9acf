"""Results as pages to mail: one HTML file each, with everything inside; nothing is loaded from elsewhere.

==============  =============================================================================================
module          holds
==============  =============================================================================================
``run``         the page of a replay
``gap``         the page of a gap analysis
``compare``     the page of two results side by side
``fleet``       the page of a batch
``page``        text, tables and figures as one file; what escapes a log's names
``charts``      figures as Vega-Lite
``modes``       contact modes: lanes, posterior bands, colours
``decimate``    fewer points for the same picture
``bundle``      the JavaScript that draws the figures (extra ``report``)
==============  =============================================================================================

A page is drawn from the tables that lie on disk, so that a stored result gives the same page.
"""
