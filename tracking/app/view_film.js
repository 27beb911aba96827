// The video under the boxes. The browser says which frame it shows; boxes are drawn for that one, never for another.

const SEEK = 0.5; // of a frame: seeking aims at its middle

function makeFilm(raw, changed) {
  if (!raw) return null;
  const video = document.createElement("video");
  const film = { video, frame: 0, able: true, failed: false, lost: new Set(raw.lost), want, play, pause, draw };
  const exact = "requestVideoFrameCallback" in video;
  let wanted = 0;

  function arrived(frame) {
    film.frame = Math.min(Math.max(frame, 1), data.length);
    changed();
  }

  function told(_, { mediaTime }) {
    arrived(Math.round(mediaTime * raw.fps) + 1);
    video.requestVideoFrameCallback(told);
  }

  function want(frame) {
    wanted = frame;
    if (!film.able || video.seeking || video.readyState < 1 || frame === film.frame) return;
    video.currentTime = (frame - 1 + SEEK) / raw.fps;
  }

  function play(speed) {
    video.playbackRate = speed;
    video.play().catch(() => {});
  }

  function pause() {
    video.pause();
    wanted = film.frame;
  }

  // The picture, less the row or column that was added to make its size even.
  function draw(ctx, width, height) {
    if (!film.frame || video.readyState < 2) return false;
    ctx.drawImage(video, 0, 0, ...data.image, 0, 0, width, height);
    return true;
  }

  video.addEventListener("loadeddata", () => want(wanted || 1));
  video.addEventListener("seeked", () => {
    if (!exact) arrived(Math.floor(video.currentTime * raw.fps) + 1);
    if (video.paused && wanted && wanted !== film.frame) setTimeout(() => want(wanted), exact ? 30 : 0);
  });
  video.addEventListener("error", () => {
    film.able = false;
    film.failed = true;
    changed();
  });
  if (exact) video.requestVideoFrameCallback(told);
  Object.assign(video, { muted: true, playsInline: true, preload: "auto", src: raw.src || inside() });
  film.plays = exact;
  return film;
}

// The video that the page itself holds, as something that can be sought in.
function inside() {
  const holder = document.getElementById("film"), text = atob(holder.textContent);
  holder.remove();
  const bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
  return URL.createObjectURL(new Blob([bytes], { type: "video/mp4" }));
}
