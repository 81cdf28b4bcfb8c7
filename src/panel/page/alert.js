// Calls the owner back to the page: a mark in the title and a short sound.
import { effect, signal } from "@preact/signals";

const marked = signal(false);
let audio;

/** Shows `title()` as the document's title, with the mark until the owner touches the page. */
export function startTitle(title) {
  effect(() => {
    document.title = (marked.value ? "● " : "") + title();
  });
  for (const gesture of ["pointerdown", "keydown"]) {
    addEventListener(gesture, () => {
      marked.value = false;
      wakeAudio();
    });
  }
}

export function callBack() {
  marked.value = true;
  try {
    if (audio?.state === "running") [660, 880].forEach((pitch_hz, i) => beep(pitch_hz, audio.currentTime + 0.18 * i));
  } catch {
    // The sound is a courtesy.
  }
}

// Browsers allow sound after a gesture only.
function wakeAudio() {
  try {
    audio ??= new AudioContext();
    audio.resume().catch(() => {});
  } catch {
    // No sound here.
  }
}

function beep(pitch_hz, at_s) {
  const tone = audio.createOscillator();
  const volume = audio.createGain();
  tone.frequency.value = pitch_hz;
  volume.gain.setValueAtTime(0.15, at_s);
  volume.gain.exponentialRampToValueAtTime(0.001, at_s + 0.16);
  tone.connect(volume).connect(audio.destination);
  tone.start(at_s);
  tone.stop(at_s + 0.17);
}
