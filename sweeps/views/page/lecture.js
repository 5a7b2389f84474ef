// Lecture mode: the first screen alone, large, with a sequence of steps if the system has one.
//
// A system's `part.lecture()` returns the steps: {title, text, changes, three}. `changes` returns changes of the state;
// `three` shows the three axes side by side in place of the map. Fields for a body of the reader's own, `#own`, stand below
// the text of a step; a body that is chosen there goes through all steps.

const lecture = { on: false, at: 0, steps: [], home: null, next: null };

/** Return the size of text in pictures, px: in a lecture, legible from the last row. */
function textSize(usual = 13) {
  return lecture.on ? Math.max(innerWidth > 860 ? 20 : 16, Math.round(innerHeight / 46)) : usual;
}

function setLecture(on) {
  lecture.on = on;
  document.documentElement.toggleAttribute("data-lecture", on);
  document.getElementById("lecture").setAttribute("aria-pressed", String(on));
  document.getElementById("lecture").textContent = on ? "Leave" : "Lecture";
  if (on) {
    [lecture.steps, lecture.at] = [part.lecture?.() ?? [], 0];
    document.documentElement.requestFullscreen?.().catch(() => {}); // if the browser forbids it, the window is used
  } else if (document.fullscreenElement) {
    document.exitFullscreen();
  }
  const steps = document.getElementById("steps");
  steps.hidden = !on || lecture.steps.length === 0;
  const own = document.getElementById("own");
  if (own && on) {
    Object.assign(lecture, { home: own.parentElement, next: own.nextSibling });
    steps.append(own);
  } else if (own) lecture.home?.insertBefore(own, lecture.next);
  if (on && lecture.steps.length > 0) showStep(0);
  else {
    delete document.documentElement.dataset.three;
    if (!on && lecture.steps.length > 0) choose(part.leave?.() ?? {});
  }
  drawPlane.key = null;
  scrollTo(0, 0);
  redraw();
}

/** Begin the step again with another body. */
function renewLecture() {
  if (!lecture.on) return;
  lecture.steps = part.lecture();
  showStep(lecture.at);
}

function showStep(at) {
  const { steps } = lecture;
  lecture.at = Math.max(0, Math.min(steps.length - 1, at));
  const { title, text, changes, three } = steps[lecture.at];
  document.getElementById("step-title").textContent = title;
  document.getElementById("step-text").textContent = text;
  document.getElementById("step-number").textContent = `${lecture.at + 1} of ${steps.length}`;
  document.getElementById("step-back").disabled = lecture.at === 0;
  document.getElementById("step-next").disabled = lecture.at === steps.length - 1;
  document.documentElement.toggleAttribute("data-three", Boolean(three));
  choose(changes());
  part.begin?.();
}

function buildLecture() {
  document.getElementById("lecture").onclick = () => setLecture(!lecture.on);
  document.getElementById("step-back").onclick = () => showStep(lecture.at - 1);
  document.getElementById("step-next").onclick = () => showStep(lecture.at + 1);
  const moves = { ArrowLeft: -1, PageUp: -1, ArrowRight: 1, PageDown: 1 }; // a remote control sends PageUp and PageDown
  addEventListener("keydown", (event) => {
    if (event.target.closest?.("input, select, textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "l" || event.key === "L" || (event.key === "Escape" && lecture.on)) setLecture(event.key !== "Escape" && !lecture.on);
    else if (lecture.on && lecture.steps.length > 0 && event.key in moves) showStep(lecture.at + moves[event.key]);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }, true);
}
