// What a robot's camera showed: a canvas below the scene.
mpgx.film = ({ src, every, count, columns, width, height }, box, ready) => {
  const canvas = document.createElement('canvas'), sheet = new Image();
  Object.assign(canvas, { width, height, className: 'film' });
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', 'What the camera of the robot shows');
  box.append(canvas);
  sheet.addEventListener('load', ready);
  sheet.src = src;
  return (step) => {
    const k = Math.min(count - 1, Math.floor(step / every));
    if (sheet.complete) canvas.getContext('2d').drawImage(sheet, (k % columns) * width, Math.floor(k / columns) * height, width, height, 0, 0, width, height);
  };
};
