"""Damaged inputs for every reader: each must end with a result or an error of one line, in bounded time and memory."""
