"use strict";
// A tap, Ctrl + wheel or the buttons zoom a map; the mouse drags it, a finger scrolls it.
for (const map of document.querySelectorAll(".map")) {
  const frame = map.querySelector(".frame"), sheet = map.querySelector(".sheet");
  let zoom = 1, dragged = null, moved = false;
  const zoomTo = (to, x = frame.clientWidth / 2, y = frame.clientHeight / 2) => {
    const was = zoom;
    zoom = Math.min(16, Math.max(1, to));
    const left = (frame.scrollLeft + x) * zoom / was - x, top = (frame.scrollTop + y) * zoom / was - y;
    sheet.style.setProperty("--zoom", zoom);
    sheet.style.cursor = zoom > 1 ? "grab" : "zoom-in";
    frame.scrollTo(left, top);
  };
  for (const button of map.querySelectorAll("button")) {
    button.addEventListener("click", () => {
      const factor = Number(button.dataset.zoom);
      zoomTo(factor ? zoom * factor : 1);
    });
  }
  sheet.addEventListener("click", (event) => {
    const box = frame.getBoundingClientRect();
    if (!moved && zoom === 1) zoomTo(3, event.clientX - box.left, event.clientY - box.top);
  });
  frame.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    const box = frame.getBoundingClientRect();
    zoomTo(zoom * Math.exp(-event.deltaY / 200), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  sheet.addEventListener("pointerdown", (event) => {
    moved = false;
    if (event.pointerType === "mouse" && zoom > 1) dragged = event;
  });
  addEventListener("pointermove", (event) => {
    if (!dragged) return;
    moved = true;
    frame.scrollBy(dragged.clientX - event.clientX, dragged.clientY - event.clientY);
    dragged = event;
  });
  addEventListener("pointerup", () => { dragged = null; });
  sheet.addEventListener("dragstart", (event) => event.preventDefault());
}
