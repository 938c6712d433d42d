'use strict';
/* global THREE */
/* exported viewer */
// viewer.show(BLOCK) shows what a `script.scene` of the page holds, in the page's one #viewer.
const viewer = (() => {
  const TARGET = '#1f6fb4', SOURCE = '#d1495b', GROUND = '#10151b';
  const QUICK = 40, RESTED = 150, LEAST = 0.02; // [ms] of a frame while turning, [ms] until all is drawn
  const part = document.getElementById('viewer'), view = document.getElementById('view');
  const step = document.getElementById('step'), said = document.getElementById('said');
  const floats = text => {
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  };
  const describe = (scene, shown) => {
    for (const [k, name] of ['target', 'source'].entries()) {
      const count = shown[name].length / 3, all = scene.of[k];
      document.getElementById(`of-${name}`).textContent = count < all ? `${count} of ${all}` : `${all}`;
    }
    document.getElementById('by').hidden = document.getElementById('by-key').hidden = !shown.q.length;
    document.getElementById('free-key').hidden = !scene.free.length;
  };

  // without WebGL: both clouds from above, what lies at the bottom of its surroundings left out
  const drawFromAbove = (pen, points, half, colour) => {
    const cell = half / 5, lowest = new Map();
    const keyOf = k => `${Math.floor(points[k] / cell)} ${Math.floor(points[k + 1] / cell)}`;
    for (let k = 0; k < points.length; k += 3)
      lowest.set(keyOf(k), Math.min(points[k + 2], lowest.get(keyOf(k)) ?? Infinity));
    const above = k => points[k + 2] > lowest.get(keyOf(k)) + cell / 4;
    let found = 0;
    for (let k = 0; k < points.length; k += 3) found += above(k);
    const all = found < 0.1 * points.length / 3, scale = pen.canvas.width / (2 * half);
    pen.fillStyle = colour;
    for (let k = 0; k < points.length; k += 3)
      if (all || above(k)) pen.fillRect((half + points[k]) * scale, (half - points[k + 1]) * scale, 1.5, 1.5);
  };
  const moved = (points, m) => points.map((_, i) => {
    const k = i - i % 3, row = i % 3;
    return m[row] * points[k] + m[row + 4] * points[k + 1] + m[row + 8] * points[k + 2] + m[row + 12];
  });
  const showPictures = scene => {
    part.classList.add('flat');
    const shown = { target: floats(scene.target), source: floats(scene.source), q: [] };
    describe(scene, shown);
    const pictures = part.querySelector('.pictures');
    pictures.querySelectorAll('img').forEach(each => each.remove());
    for (const at of [0, scene.poses.length - 1]) {
      const canvas = document.createElement('canvas'), image = new Image();
      canvas.width = canvas.height = 560;
      const pen = canvas.getContext('2d');
      pen.fillStyle = '#ffffff';
      pen.fillRect(0, 0, 560, 560);
      drawFromAbove(pen, shown.target, 0.6 * scene.extent, TARGET);
      drawFromAbove(pen, moved(shown.source, scene.poses[at]), 0.6 * scene.extent, SOURCE);
      image.src = canvas.toDataURL();
      image.alt = image.title = scene.names[at];
      pictures.append(image);
    }
  };

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas: view.querySelector('canvas'), antialias: false });
  } catch (error) {
    return { show: block => showPictures(JSON.parse(block.textContent)) };
  }
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setClearColor(GROUND);
  const camera = new THREE.PerspectiveCamera(50, 1, 0.01, 1e6);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);

  const cloud = (positions, options) => {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    return new THREE.Points(geometry, new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, ...options }));
  };
  // dark blue where the clouds agree, through white to red where they do not
  const coloursOf = q => {
    const colours = new Uint8Array(3 * q.length), ramp = new THREE.Color();
    const highest = q.slice().sort()[Math.floor(0.98 * (q.length - 1))] || 1;
    const [low, middle, high] = ['#2b5fa8', '#f2f2f2', '#c8102e'].map(c => new THREE.Color(c));
    q.forEach((value, i) => {
      const share = Math.max(0, Math.min(1, value / highest));
      if (share < 0.5) ramp.lerpColors(low, middle, 2 * share);
      else ramp.lerpColors(middle, high, 2 * share - 1);
      colours.set([ramp.r, ramp.g, ramp.b].map(c => Math.round(255 * c)), 3 * i);
    });
    return new THREE.BufferAttribute(colours, 3, true);
  };
  // a line along a translation, a ring about a turn, at the sensor
  const lineAlong = (motion, extent, pose) => {
    const [move, turn] = [new THREE.Vector3(...motion.slice(0, 3)), new THREE.Vector3(...motion.slice(3))];
    const points = [], size = 0.15 * extent;
    if (move.length() > turn.length() * extent || turn.length() === 0) {
      move.normalize().multiplyScalar(size);
      points.push(move.clone().negate(), move);
    } else {
      turn.normalize();
      const across = new THREE.Vector3(Math.abs(turn.z) < 0.9 ? 0 : 1, 0, Math.abs(turn.z) < 0.9 ? 1 : 0);
      across.cross(turn).setLength(size);
      for (let k = 0; k < 48; k++)
        for (const corner of [k, k + 1])
          points.push(across.clone().applyAxisAngle(turn, corner * Math.PI / 24));
    }
    const line = new THREE.LineSegments(
      new THREE.BufferGeometry().setFromPoints(points), new THREE.LineBasicMaterial({ color: '#ffc61a' }));
    line.position.setFromMatrixPosition(pose);
    return line;
  };

  // what is shown: its clouds, its poses, and the share of its points that is drawn while it turns
  let clouds = {}, scene = new THREE.Scene(), poses = [], names = [], extent = 1;
  let share = 1, isTurning = false, waiting = false, before = 0, resting;
  // who asks why points are missing while it turns is told what all of them would take
  const gl = renderer.getContext(), pixel = new Uint8Array(4);
  const finished = () => { // what was drawn is there, not only asked for
    render();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  };
  const drawnBy = () => {
    const named = gl.getExtension('WEBGL_debug_renderer_info');
    const name = named ? gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : '';
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name) ? ', without a graphics processor' : '';
  };
  const explain = () => {
    const note = document.getElementById('thinned'), begun = performance.now();
    finished();
    const took = Math.round(performance.now() - begun);
    note.hidden = share >= 1;
    note.textContent = `While the view turns ${Math.max(1, Math.round(100 * share))} % of the points are drawn: ` +
      `a frame of all takes ${took} ms here${drawnBy()}.`;
  };
  const render = () => {
    for (const each of Object.values(clouds)) {
      const count = each.geometry.attributes.position.count;
      each.geometry.setDrawRange(0, isTurning ? Math.ceil(share * count) : count);
    }
    renderer.render(scene, camera);
  };
  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(now => {
      waiting = false;
      const took = now - before;
      before = now;
      if (isTurning && took < 10 * QUICK) // longer: it had stood still
        share = Math.max(LEAST, Math.min(1, share * Math.max(0.5, Math.min(1.1, QUICK / took))));
      render();
    });
  };
  // a browser that draws in software cannot draw all points in time: while the view turns it draws as many as it can
  const turned = () => {
    isTurning = true;
    clearTimeout(resting);
    resting = setTimeout(() => { isTurning = false; explain(); }, RESTED);
    draw();
  };
  controls.addEventListener('change', turned);
  const look = () => {
    controls.target.set(0, 0, 0);
    camera.position.set(-0.6, -0.6, 0.7).multiplyScalar(extent);
    controls.update();
    draw();
  };
  const resize = () => {
    const { clientWidth: width, clientHeight: height } = view;
    if (!width || !height) return;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  };
  new ResizeObserver(resize).observe(view);

  const choose = () => {
    const number = Number(step.value), hasQ = clouds.means.geometry.attributes.position.count > 0;
    const isByQ = hasQ && document.querySelector('input[name=by]:checked').value === 'q';
    clouds.source.matrix.copy(poses[number]);
    clouds.source.matrixWorldNeedsUpdate = true;
    clouds.target.visible = clouds.source.visible = !isByQ;
    clouds.means.visible = isByQ;
    step.disabled = isByQ;
    said.textContent = isByQ ? 'at the result' : names[number];
    draw();
  };
  step.addEventListener('input', choose);
  document.querySelectorAll('input[name=by]').forEach(each => each.addEventListener('change', choose));
  document.getElementById('home').addEventListener('click', look);

  const show = block => {
    const given = JSON.parse(block.textContent);
    for (const each of Object.values(clouds)) {
      each.geometry.dispose();
      each.material.dispose();
    }
    const shown = Object.fromEntries(['target', 'source', 'means', 'q'].map(name => [name, floats(given[name])]));
    ({ names, extent } = given);
    poses = given.poses.map(values => new THREE.Matrix4().fromArray(values));
    clouds = {
      target: cloud(shown.target, { color: TARGET }),
      source: cloud(shown.source, { color: SOURCE, size: 3 }),
      means: cloud(shown.means, { vertexColors: true, size: 4 }),
    };
    clouds.source.matrixAutoUpdate = false;
    clouds.means.geometry.setAttribute('color', coloursOf(shown.q));
    scene = new THREE.Scene();
    scene.add(...Object.values(clouds), new THREE.AxesHelper(0.05 * extent));
    scene.add(...given.free.map(motion => lineAlong(motion, extent, poses[poses.length - 1])));
    describe(given, shown);
    step.max = names.length - 1;
    step.value = step.max;
    resize();
    look();
    choose();
  };

  // for who measures: all points again and again, each frame finished; and frames that were seen while it turns
  const framesPerSecond = frames => {
    const begun = performance.now();
    for (let k = 0; k < frames; k++) {
      camera.position.applyAxisAngle(camera.up, 0.02);
      camera.lookAt(0, 0, 0);
      finished();
    }
    return 1000 * frames / (performance.now() - begun);
  };
  const turning = seconds => new Promise(resolve => {
    const begun = performance.now();
    let frames = 0;
    const next = now => {
      if (now > begun + 1000 * seconds) {
        resolve({ framesPerSecond: 1000 * frames / (now - begun), share });
        return;
      }
      frames += 1;
      camera.position.applyAxisAngle(camera.up, 0.02);
      controls.update();
      requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  });
  return { show, framesPerSecond, turning };
})();
