"""The replay page: its data, its video, and the HTML, CSS and JavaScript that show them in the browser."""
