// How all fits are looked at: light, camera, exposure, channel.

import { fromAngles } from "./directions.js";
import { degrees, radians } from "./numbers.js";

const SAME_AZIMUTH = radians(2);

export class View {
  constructor(fits) {
    this.first = nearest(fits.flatMap((f) => f.data?.incidences ?? []), 30);
    this.firstPhi = fits.find((f) => f.anisotropic && f.data)?.data.azimuth ?? 0;
    this.reset();
  }

  reset() {
    Object.assign(this, {
      theta: this.first, phi: this.firstPhi, back: false, through: false, exposure: 0, logarithmic: true,
      channel: null, lightTurn: radians(-50), lightHeight: radians(35),
      cameraTurn: radians(-62), cameraHeight: radians(22),
    });
  }

  // The sphere's light, as the viewer sees it: x to the right, y up, z to the viewer.
  get light() {
    const c = Math.cos(this.lightHeight);
    return [
      Math.sin(this.lightTurn) * c, Math.sin(this.lightHeight), Math.cos(this.lightTurn) * c,
    ];
  }

  // The lobe's light.
  incidence() {
    const theta = radians(this.theta);
    return fromAngles(this.back ? Math.PI - theta : theta, radians(this.phi));
  }

  isNear(fit, theta, phi, tolerance) {
    const own = radians(this.back ? 180 - this.theta : this.theta);
    if (Math.abs(theta - own) > tolerance) return false;
    const turned = phi - radians(this.phi);
    const apart = Math.abs(Math.atan2(Math.sin(turned), Math.cos(turned)));
    return !fit.anisotropic || apart < SAME_AZIMUTH || Math.sin(own) < 1e-3;
  }

  // The number of the channel that is alone in a fit; null where all are shown.
  soloOf(fit) {
    const at = this.channel === null ? -1 : fit.channels.indexOf(this.channel);
    return at < 0 ? null : at;
  }

  turnLight(dx, dy) {
    this.lightTurn += dx;
    this.lightHeight = limited(this.lightHeight + dy);
  }

  turnCamera(dx, dy) {
    this.cameraTurn -= dx;
    this.cameraHeight = limited(this.cameraHeight - dy);
  }

  get lightSaid() {
    return `light ${Math.round(degrees(Math.acos(this.light[2])))}° from the viewer`;
  }
}

function limited(height) {
  return Math.min(Math.max(height, -Math.PI / 2), Math.PI / 2);
}

function nearest(values, wanted) {
  return values.reduce((a, b) => (Math.abs(b - wanted) < Math.abs(a - wanted) ? b : a), values[0] ?? wanted);
}
