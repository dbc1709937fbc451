"""Parts of the window that show something; each knows no flight, only what to show."""
