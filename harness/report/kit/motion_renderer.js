// Draws bodies, stations and the floor with WebGL 2. Everything but the floor is a capsule: a segment with a radius and
// a colour at each end. One instanced call draws all capsules of a body.
const MotionRenderer = (() => {
  "use strict";
  const FLOATS = 14; // of one capsule: two ends with their radii, then two colours
  const LIGHT = [0.35, 0.25, 0.9];
  const AXES = ["#d84a3a", "#3f9b45", "#3b6fd4"].map(rgb);

  const CAPSULE = `#version 300 es
    in vec4 shape; in vec4 endA; in vec4 endB; in vec3 colourA; in vec3 colourB;
    uniform mat4 clipFromWorld; uniform bool shadow; uniform vec3 light; uniform float girth;
    out vec3 normal; out vec3 colour; out vec3 place;
    void main() {
      vec3 along = endB.xyz - endA.xyz;
      vec3 z = length(along) > 1e-6 ? normalize(along) : vec3(0., 0., 1.);
      vec3 x = normalize(cross(z, abs(z.z) < .9 ? vec3(0., 0., 1.) : vec3(1., 0., 0.)));
      vec3 y = cross(z, x);
      normal = shape.x * x + shape.y * y + shape.z * z;
      place = mix(endA.xyz, endB.xyz, shape.w) + girth * mix(endA.w, endB.w, shape.w) * normal;
      colour = mix(colourA, colourB, shape.w);
      if (shadow) { float h = max(place.z, 0.); place = vec3(place.xy - .45 * h * light.xy / light.z, .002); }
      gl_Position = clipFromWorld * vec4(place, 1.);
    }`;
  const SHADING = `#version 300 es
    precision highp float;
    in vec3 normal; in vec3 colour; in vec3 place;
    uniform bool shadow; uniform vec3 light; uniform vec3 eye; uniform float opacity; uniform vec4 shade;
    out vec4 result;
    void main() {
      if (shadow) { result = shade; return; }
      vec3 n = normalize(normal), v = normalize(eye - place), l = normalize(light);
      float diffuse = max(dot(n, l), 0.), sky = .5 + .5 * n.z;
      float gloss = pow(max(dot(n, normalize(l + v)), 0.), 40.) * .18;
      float rim = pow(1. - max(dot(n, v), 0.), 3.) * .14;
      result = vec4(colour * (.40 + .22 * sky + .46 * diffuse) + gloss + rim, opacity);
    }`;
  const FLOOR = `#version 300 es
    in vec2 corner; uniform mat4 clipFromWorld; uniform vec2 centre; out vec2 at;
    void main() { at = centre + 14. * corner; gl_Position = clipFromWorld * vec4(at, 0., 1.); }`;
  const GRID = `#version 300 es
    precision highp float;
    in vec2 at; uniform vec2 centre; uniform vec3 line; uniform vec3 ground; out vec4 result;
    float lines(float step) {
      vec2 p = at / step, w = max(fwidth(p), vec2(1e-5)), d = abs(fract(p - .5) - .5) / w;
      float fade = clamp(1.4 - max(w.x, w.y) * 4., 0., 1.);
      return (1. - min(min(d.x, d.y), 1.)) * fade;
    }
    void main() {
      float grid = max(.45 * lines(.5), .95 * lines(1.));
      float fade = 1. - smoothstep(1.5, 9., distance(at, centre));
      result = vec4(mix(ground, line, grid), fade * mix(.55, 1., grid));
    }`;

  // Points of a unit sphere that is cut at its equator, as (x, y, z, end of the capsule), and its triangles.
  function capsuleMesh(around = 16, rings = 4) {
    const points = [], triangles = [];
    for (let k = 0; k < 2 * (rings + 1); k += 1) {
      const end = k > rings ? 1 : 0, latitude = ((k - rings - end) * Math.PI) / 2 / rings;
      for (let m = 0; m < around; m += 1) {
        const turn = (2 * Math.PI * m) / around, a = k * around + m, b = k * around + ((m + 1) % around);
        points.push(Math.cos(latitude) * Math.cos(turn), Math.cos(latitude) * Math.sin(turn), Math.sin(latitude), end);
        if (k <= 2 * rings) triangles.push(a, b, b + around, a, b + around, a + around);
      }
    }
    return { points: new Float32Array(points), triangles: new Uint16Array(triangles) };
  }

  function program(gl, vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) || "no shader");
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "no program");
    return { made, at: (name) => gl.getUniformLocation(made, name) };
  }

  // A growing list of capsules.
  class Capsules {
    constructor() {
      this.data = new Float32Array(64 * FLOATS);
      this.count = 0;
    }

    add(a, radiusA, colourA, b, radiusB, colourB) {
      const at = this.count * FLOATS;
      if (at + FLOATS > this.data.length) {
        const larger = new Float32Array(2 * this.data.length);
        larger.set(this.data);
        this.data = larger;
      }
      this.data.set([...a, radiusA, ...b, radiusB, ...colourA, ...colourB], at);
      this.count += 1;
    }
  }

  class Renderer {
    constructor(canvas) {
      const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, stencil: true, preserveDrawingBuffer: true });
      if (!gl) throw new Error("this browser has no WebGL 2");
      this.gl = gl;
      this.canvas = canvas;
      this.solid = program(gl, CAPSULE, SHADING);
      this.floor = program(gl, FLOOR, GRID);
      const mesh = capsuleMesh();
      this.corners = mesh.triangles.length;
      this.instances = gl.createBuffer();
      this.solidArray = gl.createVertexArray();
      gl.bindVertexArray(this.solidArray);
      this.#attribute(this.solid, "shape", gl.createBuffer(), mesh.points, 4);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles, gl.STATIC_DRAW);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
      for (const [name, size, first] of [["endA", 4, 0], ["endB", 4, 4], ["colourA", 3, 8], ["colourB", 3, 11]]) {
        const place = gl.getAttribLocation(this.solid.made, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * FLOATS, 4 * first);
        gl.vertexAttribDivisor(place, 1);
      }
      this.floorArray = gl.createVertexArray();
      gl.bindVertexArray(this.floorArray);
      this.#attribute(this.floor, "corner", gl.createBuffer(), new Float32Array([-1, -1, 1, -1, 1, 1, -1, -1, 1, 1, -1, 1]), 2);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }

    #attribute(shaders, name, buffer, data, size) {
      const { gl } = this, place = gl.getAttribLocation(shaders.made, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    }

    // Clear the picture; `look` has the colours `paper`, `line`, `ground` and `shade`, 0 to 1 each.
    begin(look) {
      const { gl, canvas } = this;
      gl.disable(gl.SCISSOR_TEST);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(...look.paper, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    }

    // Draw one view into the box [x, y, width, height] of the canvas. Each body is { capsules, opacity, girth, shadowless }.
    draw(box, camera, look, bodies) {
      const { gl } = this, matrix = camera.matrix(box[2] / box[3]);
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(...box);
      gl.viewport(...box);
      gl.enable(gl.BLEND);
      gl.disable(gl.DEPTH_TEST);
      gl.useProgram(this.floor.made);
      gl.bindVertexArray(this.floorArray);
      gl.uniformMatrix4fv(this.floor.at("clipFromWorld"), false, matrix);
      gl.uniform2f(this.floor.at("centre"), camera.target[0] + camera.offset[0], camera.target[1] + camera.offset[1]);
      gl.uniform3f(this.floor.at("line"), ...look.line);
      gl.uniform3f(this.floor.at("ground"), ...look.ground);
      gl.drawArrays(gl.TRIANGLES, 0, 6);

      gl.useProgram(this.solid.made);
      gl.bindVertexArray(this.solidArray);
      gl.uniformMatrix4fv(this.solid.at("clipFromWorld"), false, matrix);
      gl.uniform3f(this.solid.at("light"), ...LIGHT);
      gl.uniform3f(this.solid.at("eye"), ...camera.eye());
      gl.uniform4f(this.solid.at("shade"), ...look.shade);
      if (camera.eye()[2] > 0) this.#shadows(bodies);
      gl.enable(gl.DEPTH_TEST);
      for (const body of [...bodies].sort((p, q) => q.opacity - p.opacity)) this.#body(body);
    }

    // Shadows of all bodies on the floor; the stencil draws each pixel once, however many capsules cover it.
    #shadows(bodies) {
      const { gl } = this;
      gl.uniform1i(this.solid.at("shadow"), 1);
      gl.enable(gl.STENCIL_TEST);
      gl.stencilFunc(gl.EQUAL, 0, 255);
      gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
      for (const body of bodies.filter(({ shadowless }) => !shadowless)) this.#instances(body);
      gl.disable(gl.STENCIL_TEST);
      gl.uniform1i(this.solid.at("shadow"), 0);
    }

    // A body that is not opaque fills the depth buffer first, so that no part of it shows through another.
    #body(body) {
      const { gl } = this;
      gl.uniform1f(this.solid.at("opacity"), body.opacity);
      gl.depthFunc(gl.LEQUAL);
      if (body.opacity < 1) {
        gl.colorMask(false, false, false, false);
        this.#instances(body);
        gl.colorMask(true, true, true, true);
      }
      this.#instances(body);
    }

    #instances({ capsules, girth }) {
      const { gl } = this;
      gl.uniform1f(this.solid.at("girth"), girth);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
      gl.bufferData(gl.ARRAY_BUFFER, capsules.data.subarray(0, capsules.count * FLOATS), gl.DYNAMIC_DRAW);
      gl.drawElementsInstanced(gl.TRIANGLES, this.corners, gl.UNSIGNED_SHORT, 0, capsules.count);
    }
  }
  // "#rrggbb" -> red, green and blue, 0 to 1.
  function rgb(hex) {
    return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
  }

  // Colours of the surroundings on the reader's light or dark screen; light ones in print.
  function look() {
    const dark = matchMedia("(prefers-color-scheme: dark)").matches && !matchMedia("print").matches;
    return dark ? { paper: rgb("#1d2127"), ground: rgb("#262b33"), line: rgb("#4a535f"), shade: [0, 0, 0, 0.38] }
      : { paper: rgb("#f5f7f9"), ground: rgb("#e9edf1"), line: rgb("#b4bec9"), shade: [0.1, 0.13, 0.18, 0.2] };
  }

  // Add the bones of a body; `point` gives a joint's position [m] and `paint` its colour.
  function addBody(capsules, { bones, radii_mm: radii }, point, paint) {
    bones.forEach(([from, to], n) => {
      const [start, end] = radii[n];
      capsules.add(point(from), start / 1000, paint(from), point(to), end / 1000, paint(to));
    });
  }

  // Add a station at a position [m] with an orientation (w, x, y, z): a disc and three axes, x red, y green, z blue.
  function addStation(capsules, p, [w, x, y, z], colour) {
    const axes = [[1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];
    const along = (axis, d) => p.map((c, i) => c + d * axis[i]);
    capsules.add(along(axes[0], -0.022), 0.019, colour, along(axes[0], 0.022), 0.019, colour);
    axes.forEach((axis, i) => capsules.add(p, 0.0055, AXES[i], along(axis, 0.11), 0.0055, AXES[i]));
  }
  return { Renderer, Capsules, addBody, addStation, look, rgb };
})();
