// The video under the boxes: which frame it shows, and how to make it show another.
//
// Boxes are drawn for the frame that is seen, never for another. A picture taken out of the video carries its own time,
// also while it plays; browsers allow that for a video inside the page. One beside it is played by seeking.

const MIDDLE = 0.5; // of a frame: where seeking aims

function makeFilm(raw, changed) {
  if (!raw) return null;
  const video = document.createElement("video");
  const film = { video, frame: 0, able: true, failed: false, plays: false, lost: new Set(raw.lost), want, play, pause, draw };
  const tells = "requestVideoFrameCallback" in video;
  let wanted = 0, picture = null;

  // The picture and its frame; `time` is what the browser said of it.
  function arrived(time) {
    let taken = null;
    try {
      taken = new VideoFrame(video);
    } catch {
      if (video.readyState < 2 || video.seeking) return;
    }
    if (picture) picture.close();
    picture = taken;
    film.plays = Boolean(taken) && tells;
    film.frame = frameAt(taken ? taken.timestamp / 1e6 : time);
    changed();
  }

  function frameAt(time) {
    return Math.min(Math.max(Math.round(time * raw.fps) + 1, 1), data.length);
  }

  function told(_, { mediaTime }) {
    arrived(mediaTime);
    video.requestVideoFrameCallback(told);
  }

  // Seeks are made one after the other, the last one asked for at the end.
  function want(frame) {
    wanted = frame;
    if (!film.able || video.seeking || video.readyState < 1 || frame === film.frame) return;
    video.currentTime = (frame - 1 + MIDDLE) / raw.fps;
  }

  function play(speed) {
    video.playbackRate = speed;
    video.play().catch(() => {});
  }

  function pause() {
    video.pause();
    wanted = film.frame;
  }

  // The picture, less the row or column that was added to make its size even; false where there is none yet.
  function draw(ctx, width, height) {
    if (!film.frame || (!picture && video.readyState < 2)) return false;
    ctx.drawImage(picture || video, 0, 0, ...data.image, 0, 0, width, height);
    return true;
  }

  function sought() {
    arrived(video.currentTime - MIDDLE / raw.fps);
    if (video.paused && wanted && wanted !== film.frame) want(wanted);
  }

  video.addEventListener("loadeddata", () => (wanted > 1 ? want(wanted) : arrived(0)));
  video.addEventListener("seeked", sought);
  video.addEventListener("error", () => {
    film.able = false;
    film.failed = true;
    changed();
  });
  if (tells) video.requestVideoFrameCallback(told);
  Object.assign(video, { muted: true, playsInline: true, preload: "auto", src: raw.src || inside() });
  return film;
}

// The video that the page itself holds, as something that can be sought in.
function inside() {
  const holder = document.getElementById("film"), text = atob(holder.textContent);
  holder.remove();
  const bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
  return URL.createObjectURL(new Blob([bytes], { type: "video/mp4" }));
}
