// One fit on the page: its pictures, plots and sliders.

import { Albedo } from "./albedo.js";
import { ImageSlice } from "./image.js";
import { Lobe } from "./lobe.js";
import { Slice } from "./slice.js";
import { Sliders } from "./sliders.js";
import { Sphere } from "./sphere.js";

const STEP = Math.PI / 60;
const KEYS = {
  ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP],
};

export class Card {
  constructor(fit, glsl, view, page) {
    this.fit = fit;
    this.page = page;
    this.element = document.createElement("article");
    this.element.className = "viewer-fit";
    this.element.setAttribute("aria-label", fit.name);
    const heading = document.createElement("header");
    const name = document.createElement("h3");
    name.textContent = fit.name;
    const model = document.createElement("p");
    model.textContent = fit.model;
    heading.append(name, model);
    const pictures = document.createElement("div");
    pictures.className = "viewer-pictures";
    this.sphere = new Sphere(fit, glsl, ...this.movable(
      pictures, "Lit sphere", "drag, or use the arrow keys, to move the light",
      (dx, dy) => view.turnLight(dx, dy), "sphere",
    ));
    this.lobe = new Lobe(fit, glsl, ...this.movable(
      pictures, "Lobe", "drag, or use the arrow keys, to turn it",
      (dx, dy) => view.turnCamera(dx, dy), "camera",
    ));
    const plot = (Kind, title) => {
      const { canvas, caption } = this.figure(pictures, title);
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", `${title} of ${fit.name}`);
      return new Kind(fit, glsl, canvas, caption);
    };
    this.slice = plot(Slice, "Plane of incidence");
    this.albedo = plot(Albedo, "Albedo");
    this.image = plot(ImageSlice, "Image slice");
    const panel = document.createElement("fieldset");
    const legend = document.createElement("legend");
    legend.textContent = "Parameters";
    const sliders = document.createElement("div");
    sliders.className = "viewer-sliders";
    const reset = document.createElement("button");
    reset.type = "button";
    reset.textContent = "Back to the fit";
    panel.append(legend, sliders, reset);
    this.element.append(heading, pictures, panel);
    this.sliders = new Sliders(fit, sliders, () => page.changed("parameter", this));
    reset.addEventListener("click", () => {
      this.sliders.reset();
      page.say(`${fit.name}: parameters as fitted`);
    });
  }

  figure(box, title) {
    const figure = document.createElement("figure");
    const heading = document.createElement("h4");
    heading.textContent = title;
    const canvas = document.createElement("canvas");
    const caption = document.createElement("figcaption");
    figure.append(heading, canvas, caption);
    figure.className = `viewer-${title.toLowerCase().replace(/ /g, "-")}`;
    box.append(figure);
    return { canvas, caption };
  }

  // A picture that is turned by pointer and keys.
  movable(box, title, help, turn, what) {
    const { canvas, caption } = this.figure(box, title);
    canvas.title = help;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", `${title} of ${this.fit.name}: ${help}`);
    const move = (dx, dy) => {
      turn(dx, dy);
      this.page.changed(what);
    };
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      const size = 0.5 * Math.min(canvas.clientWidth, canvas.clientHeight);
      move(event.movementX / size, -event.movementY / size);
    });
    canvas.addEventListener("keydown", (event) => {
      const step = KEYS[event.key];
      if (!step) return;
      event.preventDefault();
      move(...step);
    });
    return [canvas, caption];
  }
}
