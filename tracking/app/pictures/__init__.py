"""Pictures and videos that commands write: contact sheets and overlays."""
