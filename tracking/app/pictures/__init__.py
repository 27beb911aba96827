"""Pictures and videos that commands write: contact sheets, overlays."""
