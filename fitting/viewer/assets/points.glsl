// The model at pairs of directions that are given as textures.
uniform sampler2D sources;
uniform sampler2D detectors;
out vec4 result;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  result = value(texelFetch(sources, at, 0).xyz, texelFetch(detectors, at, 0).xyz);
}
