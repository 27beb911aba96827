// The video under the boxes: shows a frame, plays, and reports which frame it shows.
//
// Boxes are drawn for the frame that the video shows. A picture taken out of the video carries its own time, also while
// it plays; browsers allow that for a video inside the page only. A video beside the page is played by seeking.

const MIDDLE = 0.5; // seeking aims at the middle of a frame

// onChange is called when the video shows another frame, or cannot be played.
function makePlayer(raw, onChange) {
  if (!raw) return null;
  const video = document.createElement("video");
  const player = { video, frame: 0, works: true, failed: false, canPlay: false, lost: new Set(raw.lost), seek, play, pause, draw };
  const reportsFrames = "requestVideoFrameCallback" in video;
  let wanted = 0, picture = null;

  // Takes the picture that the video shows and finds its frame; `time` is used if no picture can be taken.
  function takePicture(time) {
    let taken = null;
    try {
      taken = new VideoFrame(video);
    } catch {
      if (video.readyState < 2 || video.seeking) return;
    }
    if (picture) picture.close();
    picture = taken;
    player.canPlay = Boolean(taken) && reportsFrames;
    player.frame = frameAt(taken ? taken.timestamp / 1e6 : time);
    onChange();
  }

  function frameAt(time) {
    return Math.min(Math.max(Math.round(time * raw.fps) + 1, 1), data.length);
  }

  function onVideoFrame(_, { mediaTime }) {
    takePicture(mediaTime);
    video.requestVideoFrameCallback(onVideoFrame);
  }

  // One seek at a time: while one is under way, only the last wanted frame is kept.
  function seek(frame) {
    wanted = frame;
    if (!player.works || video.seeking || video.readyState < 1 || frame === player.frame) return;
    video.currentTime = (frame - 1 + MIDDLE) / raw.fps;
  }

  function play(speed) {
    video.playbackRate = speed;
    video.play().catch(() => {});
  }

  function pause() {
    video.pause();
    wanted = player.frame;
  }

  // Draws the picture without the row or column that makes its size even; false if there is none yet.
  function draw(ctx, width, height) {
    if (!player.frame || (!picture && video.readyState < 2)) return false;
    ctx.drawImage(picture || video, 0, 0, ...data.image, 0, 0, width, height);
    return true;
  }

  function onSeeked() {
    takePicture(video.currentTime - MIDDLE / raw.fps);
    if (video.paused && wanted && wanted !== player.frame) seek(wanted);
  }

  video.addEventListener("loadeddata", () => (wanted > 1 ? seek(wanted) : takePicture(0)));
  video.addEventListener("seeked", onSeeked);
  video.addEventListener("error", () => {
    player.works = false;
    player.failed = true;
    onChange();
  });
  if (reportsFrames) video.requestVideoFrameCallback(onVideoFrame);
  Object.assign(video, { muted: true, playsInline: true, preload: "auto", src: raw.src || embeddedVideo() });
  return player;
}

// The address of the video inside the page, in a form that can be sought in.
function embeddedVideo() {
  const holder = document.getElementById("film"), text = atob(holder.textContent);
  holder.remove();
  const bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
  return URL.createObjectURL(new Blob([bytes], { type: "video/mp4" }));
}
